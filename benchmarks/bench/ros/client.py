"""A client that asks one request at a time, in the thread of the caller."""

from collections.abc import Iterator
from contextlib import contextmanager
import time
from typing import Any, NamedTuple

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from trajectory_guard_interfaces.srv import CertifyTrajectory

from bench.cases import Case
from trajectory_guard.demo.ros.client import trajectory_to_message
from trajectory_guard.result import Verdict

# A request without an answer by then is lost [s].
PATIENCE = 20.0
PATIENCE_AT_FIRST = 0.2

# DDS brings every client the answers to all, and each leaves out the others' only when it takes
# them: with the usual 10 places, those push one's own out while this process waits for a core.
ANSWERS = QoSProfile(depth=1000)


class Answer(NamedTuple):
    """
    What came back.

    :param ms: from the call to the answer [ms].
    :param result: message CertificationResult; None: nothing came.
    """

    ms: float
    result: Any

    @property
    def above_ms(self) -> float:
        """Time that was not spent on the answer itself [ms]."""
        return self.ms - 1e3 * self.result.compute_time

    def missed(self, case: Case) -> bool:
        """Say whether a collision was called free."""
        return case.colliding and self.result.verdict == Verdict.FREE


@contextmanager
def spinning() -> Iterator[tuple[Node, SingleThreadedExecutor]]:
    """Yield a node, and an executor that has it and that somebody must spin."""
    context = Context()
    rclpy.init(args=[], context=context)
    try:
        node = Node('benchmark', context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        yield node, executor
        executor.shutdown()
        node.destroy_node()
    finally:
        context.try_shutdown()


class Client:
    """
    Asks one server.

    :param node: to ask from.
    :param executor: that has the node.
    :param server: name of the node that is asked.
    """

    def __init__(self, node: Node, executor: SingleThreadedExecutor, server: str) -> None:
        self._executor = executor
        self._client = node.create_client(
            CertifyTrajectory, f'/{server}/certify', qos_profile=ANSWERS
        )

    def connect(self, request: CertifyTrajectory.Request) -> None:
        """
        Return as soon as a request is answered.

        DDS sees a server before the server sees where to answer; a request that comes too early is
        never answered.

        :raises RuntimeError: none is.
        """
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if not self._client.service_is_ready():
                time.sleep(0.002)
            elif self.ask(request, PATIENCE_AT_FIRST).result:
                return
        raise RuntimeError(f'nobody answers {self._client.srv_name}')

    def ask(self, request: CertifyTrajectory.Request, patience: float = PATIENCE) -> Answer:
        """
        Return the answer to a request.

        Not by spin_until_future_complete: each of its turns leaves a callback in the future that
        is one more turn for the next call, which costs milliseconds after a few calls.

        :param request: what is asked.
        :param patience: without an answer by then, it is lost [s].
        """
        begin = time.perf_counter()
        future = self._client.call_async(request)
        while not future.done() and time.perf_counter() < begin + patience:
            self._executor.spin_once(patience)
        ms = 1e3 * (time.perf_counter() - begin)
        if future.done():
            return Answer(ms, future.result().result)
        self._client.remove_pending_request(future)
        return Answer(ms, None)


def request_for(case: Case) -> CertifyTrajectory.Request:
    """Return the request for a case."""
    return CertifyTrajectory.Request(trajectory=trajectory_to_message(case.trajectory))
