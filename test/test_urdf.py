"""URDF documents: what is read, and what is refused with its name and value."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from trajectory_guard.cell.robot import JointType, Mimic, Robot
from trajectory_guard.cell.urdf import load_robot, robot_from_urdf
from trajectory_guard.errors import Reason, RobotError
from trajectory_guard.shapes.mesh import MeshFile
from trajectory_guard.shapes.primitive import Box, Cylinder, Sphere

SOLID = '<collision><geometry><box size="1 2 3"/></geometry></collision>'


def link(name: str, content: str = SOLID) -> str:
    return f'<link name="{name}">{content}</link>'


def joint(
    name: str = 'j', type_: str = 'fixed', parent: str = 'a', child: str = 'b', content: str = ''
) -> str:
    return (
        f'<joint name="{name}" type="{type_}"><parent link="{parent}"/><child link="{child}"/>'
        f'{content}</joint>'
    )


def robot(*parts: str) -> Robot:
    return robot_from_urdf(f'<robot name="r">{"".join(parts)}</robot>')


def arm(type_: str = 'revolute', content: str = '<limit lower="-1" upper="2"/>') -> Robot:
    return robot(link('a'), link('b'), joint(type_=type_, content=content))


def shaped(geometry: str) -> Robot:
    return robot(link('a', f'<collision><geometry>{geometry}</geometry></collision>'))


def test_a_joint_is_read_completely() -> None:
    found = arm(
        'prismatic',
        '<origin xyz="1 2 3" rpy="0 0 0.5"/><axis xyz="0 3 4"/><limit lower="-1" upper="2"/>',
    )
    (only,) = found.joints
    assert (only.name, only.type, only.parent, only.child) == ('j', JointType.PRISMATIC, 'a', 'b')
    assert (only.lower, only.upper, only.mimic) == (-1.0, 2.0, None)
    assert np.allclose(only.axis, [0.0, 0.6, 0.8], rtol=0, atol=1e-16)
    c, s = np.cos(0.5), np.sin(0.5)
    expected = [[c, -s, 0, 1], [s, c, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    assert np.allclose(only.T_parent_joint, expected, rtol=0, atol=1e-16)
    assert (found.name, found.root, found.links) == ('r', 'a', ('a', 'b'))


def test_roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order() -> None:
    found = arm(content='<origin rpy="0.1 0.2 0.3"/><limit lower="-1" upper="2"/>')

    def turn(axis: int, angle: float) -> np.ndarray:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        R = np.eye(3)
        R[i, i] = R[j, j] = np.cos(angle)
        R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
        return R

    expected = turn(2, 0.3) @ turn(1, 0.2) @ turn(0, 0.1)
    assert np.allclose(found.joints[0].T_parent_joint[:3, :3], expected, rtol=0, atol=1e-15)


def test_defaults_are_those_of_the_specification() -> None:
    bounded = arm(content='<limit effort="1" velocity="1"/>').joints[0]
    assert (bounded.lower, bounded.upper) == (0.0, 0.0)
    assert bounded.axis.tolist() == [1.0, 0.0, 0.0]
    assert np.array_equal(bounded.T_parent_joint, np.eye(4))
    endless = arm('continuous', '<limit lower="-1" upper="1"/>').joints[0]
    assert (endless.lower, endless.upper) == (-np.inf, np.inf)
    fixed = arm('fixed', '<axis xyz="0 0 0"/>').joints[0]
    assert (fixed.lower, fixed.upper) == (0.0, 0.0)
    assert arm('fixed', '').movable == ()


@pytest.mark.parametrize('axis', ['0 0 1e-200', '1e200 0 -1e200', '0.1 0.2 0.3', '0 0 -0.9999'])
def test_axes_are_normalised(axis: str) -> None:
    found = arm(content=f'<axis xyz="{axis}"/><limit lower="-1" upper="2"/>').joints[0].axis
    given = np.array(axis.split(), dtype=float)
    assert abs(np.linalg.norm(found) - 1.0) <= 2e-16
    assert np.allclose(
        found, given / np.abs(given).max() / np.linalg.norm(given / np.abs(given).max())
    )


def test_all_shapes_of_a_link_are_read() -> None:
    found = robot_from_urdf(
        '<robot><link name="a"><visual><geometry><cone/></geometry></visual>'
        '<collision><origin xyz="1 0 0"/><geometry><box size="1 2 3"/></geometry></collision>'
        '<collision><geometry><cylinder radius="1" length="2"/></geometry></collision>'
        '<collision><geometry><sphere radius="0.5"/></geometry></collision>'
        '<collision><geometry><mesh filename="m.stl"/></geometry></collision>'
        '<collision><geometry><mesh filename="m.stl" scale="1 -1 0.1"/></geometry></collision>'
        '</link></robot>',
        '/robots',
    )
    assert [collision.shape for collision in found.collisions['a']] == [
        Box((1.0, 2.0, 3.0)),
        Cylinder(1.0, 2.0),
        Sphere(0.5),
        MeshFile('m.stl', Path('/robots')),
        MeshFile('m.stl', Path('/robots'), (1.0, -1.0, 0.1)),
    ]
    assert found.collisions['a'][0].T_link_shape[0, 3] == 1.0


def test_joints_come_in_topological_order_whatever_the_file_says() -> None:
    found = robot(
        joint('late', child='d', parent='c'),
        link('d'),
        joint('first', child='b'),
        joint('middle', child='c', parent='b'),
        joint('other', child='e'),
        *(link(name, '') for name in 'ebac'),
    )
    assert [joint.name for joint in found.joints] == ['first', 'middle', 'late', 'other']
    assert found.links == ('a', 'b', 'c', 'd', 'e')
    assert found.collision_links == ('d',)


def test_long_chains_are_no_problem() -> None:
    count = 3000
    found = robot(
        *(link(str(k), SOLID if k == count else '') for k in range(count + 1)),
        *(joint(f'j{k}', parent=str(k), child=str(k + 1)) for k in range(count)),
    )
    assert found.links == tuple(map(str, range(count + 1)))


REVOLUTE = '<limit lower="-1" upper="1"/>'


def fingers(*mimics: str) -> Robot:
    """Return a robot whose joint k has mimics[k] in it."""
    return robot(
        link('l0'),
        *(link(f'l{k + 1}') for k in range(len(mimics))),
        *(
            joint(f'j{k}', 'revolute', f'l{k}', f'l{k + 1}', REVOLUTE + mimic)
            for k, mimic in enumerate(mimics)
        ),
    )


def test_mimics_are_followed_to_their_end() -> None:
    found = fingers(
        '<mimic joint="j2" multiplier="-2" offset="0.5"/>', '', '<mimic joint="j1" offset="3"/>'
    )
    assert found.joints[0].mimic == Mimic('j1', -2.0, -5.5)
    assert found.joints[1].mimic is None
    assert found.joints[2].mimic == Mimic('j1', 1.0, 3.0)
    assert len(found.movable) == 3


def test_nothing_solid_may_hang_on_a_joint_without_a_place() -> None:
    parts = (link('a'), link('b', ''), link('c', ''), joint(type_='floating'))
    found = robot(*parts, joint('k', 'continuous', 'b', 'c'))
    assert found.links == ('a',)
    assert found.joints == ()


def test_solids_below_a_planar_joint_are_refused() -> None:
    parts = (link('a'), link('b', ''), link('c'), joint(type_='planar'))
    with pytest.raises(RobotError, match="joint 'j': a planar joint") as caught:
        robot(*parts, joint('k', 'fixed', 'b', 'c'))
    assert caught.value.reason is Reason.JOINT_UNSUPPORTED


def test_a_floating_joint_is_a_translation_and_a_rotation() -> None:
    parts = (link('a'), link('b', ''), link('c'), joint(type_='floating'))
    found = robot(*parts, joint('k', 'continuous', 'b', 'c'))
    assert found.floating == 'j'
    assert [(joint.name, joint.type) for joint in found.joints] == [
        ('j/translation', JointType.TRANSLATION),
        ('j/rotation', JointType.ROTATION),
        ('k', JointType.CONTINUOUS),
    ]
    assert found.links == ('a', 'b/translation', 'b', 'c')


@pytest.mark.parametrize(
    'joints',
    [
        (joint(type_='continuous'), joint('k', 'floating', 'b', 'c')),
        (joint(type_='floating'), joint('k', 'floating', 'b', 'c')),
        (joint(type_='floating'), joint('k', 'floating', 'a', 'c')),
    ],
    ids=['below a joint', 'below another', 'beside another'],
)
def test_one_floating_joint_at_the_root_is_all(joints: tuple[str, str]) -> None:
    with pytest.raises(RobotError, match="joint 'k': a floating joint") as caught:
        robot(link('a'), link('b'), link('c'), *joints)
    assert caught.value.reason is Reason.JOINT_UNSUPPORTED


def test_names_of_a_floating_joints_parts_are_taken() -> None:
    with pytest.raises(RobotError, match="'j/rotation' is the name of a floating"):
        robot(
            link('a'),
            link('b'),
            link('c'),
            joint(type_='floating'),
            joint('j/rotation', 'fixed', 'b', 'c'),
        )


@pytest.mark.parametrize('type_', ['translation', 'rotation', 'ball'])
def test_other_joint_types_are_refused(type_: str) -> None:
    with pytest.raises(RobotError, match=f'joint type {type_!r}') as caught:
        robot(link('a'), link('b'), joint(type_=type_))
    assert caught.value.reason is Reason.JOINT_UNSUPPORTED


MESH = '<mesh filename="m.stl" scale="{}"/>'
REFUSED = [
    # Not a robot.
    (lambda: robot_from_urdf(''), Reason.ROBOT_INVALID, 'broken XML'),
    (lambda: robot_from_urdf('<robot name="r"><link'), Reason.ROBOT_INVALID, 'broken XML'),
    (lambda: robot_from_urdf(b'\xff\xfe\x00'), Reason.ROBOT_INVALID, 'broken XML'),
    (lambda: robot_from_urdf('<robot>\ud800</robot>'), Reason.ROBOT_INVALID, 'broken XML'),
    (lambda: robot_from_urdf('<sdf/>'), Reason.ROBOT_INVALID, '<sdf>'),
    (
        lambda: robot_from_urdf(
            '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>'
        ),
        Reason.ROBOT_INVALID,
        "xacro: 'arm'",
    ),
    # Not a tree.
    (lambda: robot(), Reason.ROBOT_EMPTY, 'no link'),
    (lambda: robot(link('a', '')), Reason.ROBOT_EMPTY, 'collision'),
    (lambda: robot(link('a'), link('b')), Reason.ROBOT_INVALID, "got 2: ['a', 'b']"),
    (lambda: robot(link('a'), link('a')), Reason.ROBOT_INVALID, "two links are called 'a'"),
    (
        lambda: robot(link('a'), link('b'), link('c'), joint(), joint(child='c')),
        Reason.ROBOT_INVALID,
        "two joints are called 'j'",
    ),
    (lambda: robot(link(''), link('b')), Reason.ROBOT_INVALID, "'name' is missing"),
    (lambda: robot(link('a'), joint()), Reason.ROBOT_INVALID, "child link 'b' does not exist"),
    (lambda: robot(link('b'), joint()), Reason.ROBOT_INVALID, "parent link 'a' does not exist"),
    (lambda: robot(link('a'), joint(child='a')), Reason.ROBOT_INVALID, 'got 0'),
    (
        lambda: robot(link('a'), link('b'), joint(), joint('k')),
        Reason.ROBOT_INVALID,
        "joint 'k': link 'b' is already moved by 'j'",
    ),
    (
        lambda: robot(link('r'), link('a'), link('b'), joint(), joint('k', parent='b', child='a')),
        Reason.ROBOT_INVALID,
        "cycle: ['j', 'k']",
    ),
    (
        lambda: robot(
            link('a'), link('b'), '<joint name="j" type="fixed"><parent link="a"/></joint>'
        ),
        Reason.ROBOT_INVALID,
        "joint 'j': <child> is missing",
    ),
    # Joints.
    (lambda: arm('ball'), Reason.JOINT_UNSUPPORTED, "joint 'j': joint type 'ball'"),
    (lambda: arm(''), Reason.ROBOT_INVALID, "'type' is missing"),
    (lambda: arm('continuous', '<axis xyz="0 0 0"/>'), Reason.JOINT_AXIS_INVALID, "joint 'j'"),
    (
        lambda: arm('continuous', '<axis xyz="0 inf 0"/>'),
        Reason.JOINT_AXIS_INVALID,
        '[0.0, inf, 0.0]',
    ),
    (lambda: arm('continuous', '<axis xyz="0 nan 1"/>'), Reason.JOINT_AXIS_INVALID, '0 nan 1'),
    (lambda: arm('continuous', '<axis xyz="0 1"/>'), Reason.JOINT_AXIS_INVALID, "'0 1'"),
    (lambda: arm('continuous', '<axis/>'), Reason.JOINT_AXIS_INVALID, 'xyz'),
    (lambda: arm(content=''), Reason.LIMITS_MISSING, "joint 'j': a revolute joint"),
    (lambda: arm('prismatic', ''), Reason.LIMITS_MISSING, 'prismatic'),
    (lambda: arm(content='<limit lower="2" upper="1"/>'), Reason.ROBOT_INVALID, '[2.0, 1.0]'),
    (lambda: arm(content='<limit lower="nan" upper="1"/>'), Reason.ROBOT_INVALID, "'nan'"),
    (lambda: arm(content='<limit lower="-1" upper="1_0"/>'), Reason.ROBOT_INVALID, "'1_0'"),
    (lambda: arm(content='<limit lower="inf" upper="inf"/>'), Reason.ROBOT_INVALID, 'inf'),
    (lambda: arm(content=REVOLUTE * 2), Reason.ROBOT_INVALID, '2 elements <limit>'),
    (lambda: arm('fixed', '<origin xyz="0 0"/>'), Reason.ROBOT_INVALID, "'0 0'"),
    (lambda: arm('fixed', '<origin xyz="0 0 nan"/>'), Reason.ROBOT_INVALID, 'nan'),
    (lambda: arm('fixed', '<origin xyz="0 0 1e10"/>'), Reason.ROBOT_INVALID, '10000000000.0'),
    (lambda: arm('fixed', '<origin rpy="0 inf 0"/>'), Reason.ROBOT_INVALID, 'inf'),
    (lambda: arm('fixed', '<origin quat_xyzw="0 0 0 1"/>'), Reason.ROBOT_INVALID, 'quat_xyzw'),
    # Mimics.
    (lambda: fingers('<mimic joint="x"/>'), Reason.ROBOT_INVALID, "'j0' mimics 'x'"),
    (lambda: fingers('<mimic joint="j0"/>'), Reason.ROBOT_INVALID, "['j0', 'j0']"),
    (
        lambda: fingers('<mimic joint="j1"/>', '<mimic joint="j0"/>'),
        Reason.ROBOT_INVALID,
        'mimic each other',
    ),
    (
        lambda: fingers('', '<mimic joint="j0" offset="inf"/>'),
        Reason.ROBOT_INVALID,
        "joint 'j1': <mimic> is not finite",
    ),
    (lambda: fingers('', '<mimic/>'), Reason.ROBOT_INVALID, "'joint' is missing"),
    # Geometry.
    (lambda: robot(link('a', '<collision/>')), Reason.ROBOT_INVALID, "link 'a'"),
    (lambda: shaped(''), Reason.ROBOT_INVALID, 'one <geometry>'),
    (lambda: shaped('<sphere radius="1"/>' * 2), Reason.ROBOT_INVALID, 'one <geometry>'),
    (
        lambda: shaped('<capsule radius="1" length="1"/>'),
        Reason.GEOMETRY_UNSUPPORTED,
        "link 'a': geometry <capsule>",
    ),
    (lambda: shaped('<plane/>'), Reason.GEOMETRY_UNSUPPORTED, '<plane>'),
    (lambda: shaped('<box size="1 1"/>'), Reason.ROBOT_INVALID, "'1 1'"),
    (lambda: shaped('<box size="1 0 1"/>'), Reason.ROBOT_INVALID, 'box size'),
    (lambda: shaped('<sphere radius="-1"/>'), Reason.ROBOT_INVALID, '-1.0'),
    (lambda: shaped('<sphere radius="nan"/>'), Reason.ROBOT_INVALID, "'nan'"),
    (lambda: shaped('<sphere/>'), Reason.ROBOT_INVALID, "'radius' is missing"),
    (lambda: shaped('<cylinder radius="1" length="inf"/>'), Reason.ROBOT_INVALID, 'length'),
    (lambda: shaped('<cylinder radius="${r}" length="1"/>'), Reason.ROBOT_INVALID, '${r}'),
    (lambda: shaped('<mesh/>'), Reason.ROBOT_INVALID, "'filename' is missing"),
    (lambda: shaped(MESH.format('1 0 1')), Reason.ROBOT_INVALID, '1.0 0.0 1.0'),
    (lambda: shaped(MESH.format('1 inf 1')), Reason.ROBOT_INVALID, 'inf'),
    (lambda: shaped(MESH.format('1')), Reason.ROBOT_INVALID, "'1'"),
]


@pytest.mark.parametrize(('make', 'reason', 'named'), REFUSED)
def test_what_cannot_be_judged_is_refused_by_name(
    make: Callable[[], Robot], reason: Reason, named: str
) -> None:
    with pytest.raises(RobotError) as caught:
        make()
    assert caught.value.reason is reason
    assert named in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    path = tmp_path / 'arm.urdf'
    with pytest.raises(RobotError, match=r'arm\.urdf') as caught:
        load_robot(path)
    assert caught.value.reason is Reason.ROBOT_INVALID
    path.write_text('<robot')
    with pytest.raises(RobotError, match=r'arm\.urdf: broken XML'):
        load_robot(path)


def test_a_file_and_its_text_are_the_same_robot(tmp_path: Path) -> None:
    text = '<?xml version="1.0" encoding="utf-8"?>\n<robot name="r">' + link('ä') + '</robot>'
    (tmp_path / 'arm.urdf').write_bytes(text.encode())
    from_file, from_text = load_robot(tmp_path / 'arm.urdf'), robot_from_urdf(text)
    assert from_file.digest() == from_text.digest()
    assert from_file.links == from_text.links == ('ä',)
