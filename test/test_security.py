"""The policy of docs/security.md: who may do what, and that the nodes need no more."""

from collections.abc import Callable
from contextlib import suppress
import os
from pathlib import Path
import stat
import subprocess
import sys
import time
from typing import Any
import xml.etree.ElementTree as ET

from gate_process import gate_process
from guard_process import (
    ARM,
    asker,
    ENVIRONMENT,
    EXECUTABLE,
    guard_process,
    parameters,
    PATIENCE,
    SCENE,
)
import pytest
from rclpy.node import Node, NodeNameNonExistentError

Start = Callable[..., Any]

ROOT = Path(__file__).parents[1]
POLICY = ROOT / 'security' / 'policies' / 'trajectory_guard.policy.xml'
GUARD, GATE = '/trajectory_guard/guard', '/trajectory_guard/gate'
OTHERS = ('/planner', '/controller', '/perception', '/operator')

CONTROLLER_TOPIC = 'rt/joint_trajectory_controller/joint_trajectory'
REQUESTS, ANSWERS = 'rq/guard/certifyRequest', 'rr/guard/certifyReply'


@pytest.fixture(scope='module')
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('keys') / 'keystore'
    subprocess.run([sys.executable, ROOT / 'security' / 'keystore.py', POLICY, folder], check=True)
    return folder


def allowed(keystore: Path, enclave: str, right: str) -> set[str]:
    """Return the topics that the permissions of an enclave allow, their signature verified."""
    folder = keystore / 'enclaves' / enclave.lstrip('/')
    text = verified(folder / 'permissions.p7s', folder / 'permissions_ca.cert.pem')
    (grant,) = ET.fromstring(text).iterfind('permissions/grant')
    assert grant.findtext('subject_name') == f'CN={enclave}'
    assert grant.findtext('default') == 'DENY'
    return {topic.text or '' for topic in grant.iterfind(f'allow_rule/{right}/topics/topic')}


def verified(file: Path, authority: Path) -> str:
    """Return what was signed; fail if it was not signed by that authority."""
    arguments = ['smime', '-verify', '-text', '-in', file, '-CAfile', authority]
    return subprocess.run(
        ['openssl', *arguments], capture_output=True, text=True, check=True
    ).stdout


def holders(keystore: Path, right: str, topic: str) -> set[str]:
    """Return the enclaves that have a right on a topic."""
    return {
        enclave for enclave in (GUARD, GATE, *OTHERS) if topic in allowed(keystore, enclave, right)
    }


def test_only_the_gate_speaks_to_the_controller(keystore: Path) -> None:
    assert holders(keystore, 'publish', CONTROLLER_TOPIC) == {GATE}
    action = 'rq/joint_trajectory_controller/follow_joint_trajectory/_action/send_goalRequest'
    assert holders(keystore, 'publish', action) == {GATE}


def test_only_the_guard_answers(keystore: Path) -> None:
    assert holders(keystore, 'publish', ANSWERS) == {GUARD}
    assert holders(keystore, 'publish', 'rt/guard/status') == {GUARD}
    assert holders(keystore, 'publish', REQUESTS) == {GATE, '/planner'}


def test_who_plans_says_nothing_of_robot_and_scene(keystore: Path) -> None:
    for topic in ('rt/joint_states', 'rt/robot_description'):
        assert holders(keystore, 'publish', topic) == {'/controller'}
    assert holders(keystore, 'publish', 'rt/guard/scene') == {'/perception'}
    for service in ('set_parameters', 'set_parameters_atomically', 'change_state'):
        assert holders(keystore, 'publish', f'rq/guard/{service}Request') == {'/operator'}


def test_what_was_changed_is_not_verified(keystore: Path, tmp_path: Path) -> None:
    folder = keystore / 'enclaves' / 'planner'
    changed = tmp_path / 'permissions.p7s'
    text = (folder / 'permissions.p7s').read_text()
    changed.write_text(text.replace('rt/gate/trajectory', CONTROLLER_TOPIC))
    assert changed.read_text() != text
    with pytest.raises(subprocess.CalledProcessError):
        verified(changed, folder / 'permissions_ca.cert.pem')


def test_an_enclave_is_who_the_authority_says(keystore: Path) -> None:
    authority = keystore / 'public' / 'identity_ca.cert.pem'
    for enclave in (GUARD, GATE, *OTHERS):
        folder = keystore / 'enclaves' / enclave.lstrip('/')
        command = ['openssl', 'verify', '-CAfile', authority, folder / 'cert.pem']
        subprocess.run(command, capture_output=True, check=True)
        assert stat.S_IMODE((folder / 'key.pem').stat().st_mode) == 0o600
    assert not list((keystore / 'enclaves').rglob('ca.key.pem'))


def test_another_run_keeps_the_keys(keystore: Path) -> None:
    before = {file: file.read_bytes() for file in keystore.rglob('*key.pem')}
    assert len(before) == 1 + len((GUARD, GATE, *OTHERS))
    command = [sys.executable, ROOT / 'security' / 'keystore.py', POLICY, keystore]
    subprocess.run(command, check=True)
    assert {file: file.read_bytes() for file in before} == before


@pytest.fixture(scope='module')
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('workcell')
    (folder / 'arm.urdf').write_text(ARM)
    (folder / 'scene.urdf').write_text(SCENE)
    return folder


@pytest.mark.parametrize(
    ('name', 'start', 'enclave'),
    [('guard', guard_process, GUARD), ('gate', gate_process, GATE)],
    ids=['guard', 'gate'],
)
def test_the_policy_allows_what_a_node_does(
    keystore: Path, tmp_path: Path, name: str, start: Start, enclave: str
) -> None:
    """Listed are the ends of topics and services that the node has, and is allowed to have."""
    here = f'/{name}_house'
    with start(tmp_path, here[1:]) as process, asker() as ask:
        seen = [set[str](), set[str]()]
        for _ in range(int(PATIENCE)):
            before = seen
            with suppress(NodeNameNonExistentError):
                seen = ends(ask.node, name, here)
            if f'rr{here}/{name}/get_parametersReply' in seen[0] and seen == before:
                break
            assert process.process.poll() is None, process.said()
            time.sleep(1.0)
    for right, topics in zip(('publish', 'subscribe'), seen, strict=True):
        assert f'rt{here}/{name}/status' in seen[0]
        rooted = {topic.replace(f'{here}/', '/', 1) for topic in topics}
        assert rooted <= allowed(keystore, enclave, right)


def ends(node: Node, name: str, namespace: str) -> list[set[str]]:
    """Return the DDS topics that a node publishes, and those it subscribes to."""
    writes = {f'rt{t}' for t, _ in node.get_publisher_names_and_types_by_node(name, namespace)}
    reads = {f'rt{t}' for t, _ in node.get_subscriber_names_and_types_by_node(name, namespace)}
    for service, _ in node.get_service_names_and_types_by_node(name, namespace):
        writes.add(f'rr{service}Reply')
        reads.add(f'rq{service}Request')
    for service, _ in node.get_client_names_and_types_by_node(name, namespace):
        writes.add(f'rq{service}Request')
        reads.add(f'rr{service}Reply')
    return [writes, reads]


def test_without_a_key_the_guard_does_not_run(files: Path) -> None:
    done = subprocess.run(
        [EXECUTABLE, '--ros-args', *parameters(scene_files=f'[{files / "scene.urdf"}]')],
        env=os.environ
        | ENVIRONMENT
        | {
            'ROS_SECURITY_ENABLE': 'true',
            'ROS_SECURITY_STRATEGY': 'Enforce',
            'ROS_SECURITY_KEYSTORE': str(files / 'nowhere'),
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert done.returncode == 2, done.stderr
    assert 'SECURITY ERROR' in done.stderr


@pytest.mark.skipif(
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE' not in os.environ, reason='this ROS may have DDS security'
)
@pytest.mark.parametrize(
    ('executable', 'enclave'),
    [(EXECUTABLE, GUARD), (EXECUTABLE.with_name('gate'), GATE)],
    ids=['guard', 'gate'],
)
def test_without_security_in_the_middleware_no_node_runs(
    keystore: Path, files: Path, executable: Path, enclave: str
) -> None:
    done = subprocess.run(
        [executable],
        env=os.environ
        | ENVIRONMENT
        | {
            'ROS_SECURITY_ENABLE': 'true',
            'ROS_SECURITY_STRATEGY': 'Enforce',
            'ROS_SECURITY_KEYSTORE': str(keystore),
            'ROS_SECURITY_ENCLAVE_OVERRIDE': enclave,
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert done.returncode == 2, done.stderr
    assert 'security libraries' in done.stderr
    assert 'Traceback' not in done.stderr
