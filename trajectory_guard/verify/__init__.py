"""
Checks certificates; shares no search, no kernel and no curve code with what made them.

Everything here is exact (fmpq) or a ball that certainly contains the exact value (arb).
"""

from trajectory_guard.verify.verified import Verified
from trajectory_guard.verify.verifier import verify

__all__ = ['Verified', 'verify']
