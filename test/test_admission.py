"""How many are let in, from many threads."""

from concurrent.futures import ThreadPoolExecutor
import threading

import pytest

from trajectory_guard.errors import Reason, RequestError
from trajectory_guard.ros.admission import Admission


def test_no_more_than_allowed_and_each_leaves() -> None:
    admission, inside, most = Admission(), [], []
    everybody = threading.Barrier(20)

    def come() -> Reason | None:
        everybody.wait()
        try:
            with admission.entered(5):
                inside.append(1)
                most.append(len(inside))
                waiting.wait(0.2)
                inside.pop()
        except RequestError as error:
            return error.reason
        return None

    waiting = threading.Event()
    with ThreadPoolExecutor(20) as pool:
        reasons = list(pool.map(lambda _: come(), range(20)))
    assert reasons.count(None) == max(most) == 5
    assert reasons.count(Reason.BUSY) == 15
    assert admission.empty


def test_leaves_with_an_error_too() -> None:
    admission = Admission()
    with pytest.raises(ZeroDivisionError), admission.entered(1):
        assert not admission.empty
        raise ZeroDivisionError
    assert admission.empty


def test_an_answer_counts_until_it_has_left() -> None:
    admission = Admission()
    admission.taken()
    with admission.entered(1):
        pass
    assert not admission.empty
    admission.sent()
    assert admission.empty


def test_closed_lets_nobody_in_and_everybody_out() -> None:
    admission = Admission()
    with admission.entered(2):
        admission.close()
        with pytest.raises(RequestError) as caught, admission.entered(2):
            pass
        assert caught.value.reason is Reason.NOT_READY
        assert admission.closed and not admission.empty
    assert admission.empty
