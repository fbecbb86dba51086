"""An obstacle that a viewer may show is there, or the state says that something is missing."""

from collections import Counter
import copy

from guard_process import ARM
from marker_messages import array, BASE, delete, delete_all, marker
import numpy as np
import pytest
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.marker import added_keys, changes_from_message
from trajectory_guard.cell.urdf import robot_from_urdf
from trajectory_guard.cell.workcell import Workcell
from trajectory_guard.certify import judge
from trajectory_guard.errors import Reason, TrajectoryGuardError
from trajectory_guard.markers.live_markers import LiveMarkers
from trajectory_guard.markers.marker import Key
from trajectory_guard.markers.marker_scene import MarkerLimits, with_markers
from trajectory_guard.paths.trajectory import Point, Trajectory
from trajectory_guard.result import Verdict

FRAMES = {BASE: ()}
LIMITS = MarkerLimits(markers=6, points=20)
BAD = marker(scale=(0, 0, 0))
# The arm sweeps over it.
WITNESS = marker(number=9, ns='witness', scale=(0.1, 0.1, 0.1), position=(0.7, 0.2, 0.0))


def after(state: LiveMarkers, *messages: Marker, limits: MarkerLimits = LIMITS) -> LiveMarkers:
    """Return what is known after one array, as the node does it."""
    message = array(*messages)
    try:
        return state.received(changes_from_message(message, limits), limits, FRAMES)
    except TrajectoryGuardError as error:
        return state.refused(error, added_keys(message, limits))


def names(state: LiveMarkers) -> list[str]:
    return [obstacle.name for obstacle in state.scene.obstacles(FRAMES)]


def test_a_refused_array_leaves_obstacles_and_says_what_is_missing() -> None:
    state = after(after(LiveMarkers(), marker(number=1)), marker(number=2), BAD)
    assert names(state) == ['ns/1']
    assert set(state.missing) == {Key('ns', 2), Key('ns', 0)}
    assert state.error is not None and state.error.reason is Reason.SCENE_INVALID


@pytest.mark.parametrize(
    'healing',
    [
        [[marker(number=2), marker(number=0)]],
        [[marker(number=2)], [marker(number=0)]],
        [[delete(2)], [marker(number=0)]],
        [[delete_all()]],
        [[delete_all('ns')]],
        [[marker(number=0), marker(number=2), marker(number=7)]],
    ],
)
def test_what_is_missing_is_missing_until_it_comes_or_goes(healing: list[list[Marker]]) -> None:
    state = after(LiveMarkers(), marker(number=2), BAD)
    for messages in healing:
        assert state.error is not None
        state = after(state, *messages)
    assert state.error is None


@pytest.mark.parametrize(
    'other', [[marker(number=9)], [delete(9)], [delete_all('other')], [marker(ns='m')], [BAD], []]
)
def test_others_do_not_heal_it(other: list[Marker]) -> None:
    state = after(LiveMarkers(), marker(number=2), BAD)
    assert after(state, *other).error is not None


def test_an_array_that_was_not_read_is_healed_by_a_new_beginning_only() -> None:
    state = after(LiveMarkers(), *[marker(number=k) for k in range(7)])
    assert state.error is not None and state.error.reason is Reason.TOO_LARGE
    for k in range(7):
        state = after(state, marker(number=k), delete(k))
    assert after(state, delete_all('ns')).error is not None
    assert after(state, delete_all(), marker(number=1)).error is None


def test_an_unknown_frame_is_refused_as_a_whole() -> None:
    state = after(LiveMarkers(), marker(number=1), marker(number=2, frame='map'))
    assert names(state) == [] and set(state.missing) == {Key('ns', 1), Key('ns', 2)}
    assert state.error is not None and state.error.reason is Reason.FRAME_UNKNOWN


# Hostile messages

NUMBERS = [0.0, -1.0, 1.0, np.nan, np.inf, -np.inf, 1e308, 1e10, 5e-324, -0.0, 1e-16]
TEXTS = ['', 'base', 'map', '/base', 'ns', 'n' * 300, 'a/1', 'é\u2028', 'file:///dev/zero']


def mutated(rng: np.random.Generator, number: int) -> Marker:
    """Return a marker with some fields replaced by what nobody expects."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    kind = int(rng.choice([1, 2, 3, 6, 7, 11]))
    message = marker(kind, number, points=points[: 3 if kind == 11 else int(rng.integers(4))])
    for _ in range(int(rng.integers(3))):
        value = float(rng.choice(NUMBERS))
        match rng.integers(9):
            case 0:
                setattr(message.pose.position, str(rng.choice([*'xyz'])), value)
            case 1:
                setattr(message.pose.orientation, str(rng.choice([*'xyzw'])), value)
            case 2:
                setattr(message.scale, str(rng.choice([*'xyz'])), value)
            case 3:
                message.type = int(rng.integers(-2, 15))
            case 4:
                message.action = int(rng.integers(-1, 5))
            case 5:
                message.header.frame_id = str(rng.choice(TEXTS))
            case 6:
                message.mesh_resource = str(rng.choice(TEXTS))
            case 7 if message.points:
                message.points[0] = copy.copy(message.points[0])
                setattr(message.points[0], str(rng.choice([*'xyz'])), value)
            case 8:
                message.ns = str(rng.choice(TEXTS))
    return message


def test_no_mutated_marker_is_lost() -> None:
    """
    Against a bookkeeping of its own: what was added last is an obstacle, or it is missing.

    A text shows no solid, and a list without points none; all else that was added must be there.
    """
    rng = np.random.default_rng(0)
    state, shown, refused = LiveMarkers(), {}, 0
    for _ in range(4000):
        messages = [mutated(rng, int(rng.integers(3))) for _ in range(int(rng.integers(1, 5)))]
        before = state
        state = after(state, *messages, limits=MarkerLimits(points=1000))
        taken = state.scene is not before.scene
        refused += not taken
        added = {Key(m.ns, m.id) for m in messages if m.action not in (Marker.DELETE, 3)}
        assert taken or added <= state.missing.keys()
        assert not taken or not added & state.missing.keys()
        for message in messages:
            key = Key(message.ns, message.id)
            if message.action == Marker.ADD:
                shown[key] = taken and not (
                    message.type == Marker.TEXT_VIEW_FACING
                    or (message.type in (6, 7) and not message.points)
                )
            elif taken:
                for other in list(shown):
                    everything = message.action == Marker.DELETEALL
                    if other == key or (everything and message.ns in ('', other.namespace)):
                        del shown[other]
        there = {*names(state), *(key.name for key in state.missing)}
        lost = {key.name for key, solid in shown.items() if solid} - there
        assert not lost
        # The bookkeeping of refused arrays starts anew with what is known to be there.
        if not taken:
            shown = {key: True for key in state.scene.entries if key.name in names(state)}
            shown |= {key: True for key in state.missing if isinstance(key, Key)}
    assert 1000 < refused < 3500


def with_witness(rng: np.random.Generator) -> list[Marker]:
    """Return the markers of an array, some of them about the cube that the arm cannot miss."""
    messages = [mutated(rng, int(rng.integers(3))) for _ in range(int(rng.integers(4)))]
    if rng.random() < 0.2:
        messages.insert(0, delete_all())
    match rng.integers(20):
        case 0 | 1 | 2 | 3:
            messages.append(copy.deepcopy(WITNESS))
        case 4:
            messages.append(delete(WITNESS.id, WITNESS.ns))
        case 5:
            messages.append(delete_all(WITNESS.ns))
        case 6:
            bad = mutated(rng, WITNESS.id)
            bad.ns = WITNESS.ns
            messages.append(bad)
    return messages


def witness_after(there: bool | None, messages: list[Marker]) -> bool | None:
    """Return whether the cube is there after an array that was taken; None: who knows."""
    for message in messages:
        if message.action == Marker.DELETEALL and message.ns in ('', WITNESS.ns):
            there = False
        elif (message.ns, message.id) == (WITNESS.ns, WITNESS.id):
            there = {Marker.DELETE: False}.get(message.action)
            if message == WITNESS:
                there = True
    return there


@pytest.mark.parametrize('count', [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_nothing_is_free_through_a_cube_that_is_shown(count: int) -> None:
    """Whatever else comes: a cube in the way is an obstacle, or the guard is not ready."""
    robot = robot_from_urdf(ARM)
    points = [Point(0, (0.0, 0.0)), Point(10**9, (0.5, 0.0))]
    swing = Trajectory.from_points(('shoulder', 'elbow'), points)
    limits = MarkerLimits(points=1000)
    rng = np.random.default_rng(5)
    state, there = LiveMarkers(), False
    seen: Counter[tuple[bool | None, Verdict | None]] = Counter()
    for k in range(count):
        messages = with_witness(rng)
        before, state = state, after(state, *messages, limits=limits)
        if state.scene is before.scene:
            # What would only have removed something leaves it.
            adding = any(m.action not in (Marker.DELETE, Marker.DELETEALL) for m in messages)
            assert state.error is not None or not adding
        else:
            there = witness_after(there, messages)
        verdict = None
        if state.error is None and k % 20 == 0 and state.scene.obstacles(FRAMES):
            verdict = judge(
                Workcell(robot, with_markers(None, state.scene, FRAMES)), swing
            ).verdict
            assert verdict in (Verdict.FREE, Verdict.SUSPECT, Verdict.COLLISION)
            assert not (there and verdict is Verdict.FREE)
        seen[there, verdict] += 1
    assert seen[True, Verdict.COLLISION] > count // 1000
    assert seen[False, Verdict.FREE] > count // 1000
    assert sum(seen[there, None] for there in (True, False, None)) > count // 10


def test_what_is_no_array_is_an_error_not_an_obstacle() -> None:
    with pytest.raises(AttributeError):
        changes_from_message(Marker())
    assert added_keys(Marker()) is None
    assert changes_from_message(MarkerArray()) == ()
