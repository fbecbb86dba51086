"""The commands ``check``, ``replay`` and ``verify``."""

from pathlib import Path
from typing import Annotated, Any

import typer

from trajectory_guard.command_line import options
from trajectory_guard.command_line.request import Request, Verification
from trajectory_guard.command_line.run import run, run_verify
from trajectory_guard.errors import RequestError
from trajectory_guard.settings import Settings

_DEFAULTS = Settings()

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    # Plain text: boxes break messages in the middle of a path.
    rich_markup_mode=None,
)


@app.callback()
def main() -> None:
    """
    Prove where the motion that a controller plays is free of collisions.

    Exit codes: 0 all free, 1 something is not free, 2 bad input, 3 internal error.
    """


@app.command()
def check(
    trajectories: Annotated[
        list[Path],
        typer.Argument(
            metavar='TRAJECTORY',
            help='(MultiDOF)JointTrajectory as YAML or JSON '
            '(`ros2 topic echo --full-length`), or a bag.',
        ),
    ],
    urdf: options.Urdf,
    scene: options.Scenes,
    scene_pose: options.ScenePose = None,
    tolerance: options.Tolerance = _DEFAULTS.tolerance,
    clearance: options.Clearance = _DEFAULTS.clearance,
    tracking_tolerance: options.TrackingTolerance = _DEFAULTS.tracking_tolerance[0],
    start: options.Start = None,
    no_self_collision: options.NoSelfCollision = False,
    no_joint_limits: options.NoJointLimits = False,
    allow_end_velocity: options.AllowEndVelocity = False,
    deadline: options.Deadline = None,
    scope: options.ScopeOption = _DEFAULTS.scope,
    cover: options.CoverOption = _DEFAULTS.cover,
    refine: options.Refine = _DEFAULTS.refine,
    contacts: options.Contacts = False,
    certificate: options.Certificate = None,
    json: options.Json = False,
) -> None:
    """Certify trajectories from files; of a bag, what `replay` would take."""
    settings = _settings(
        tolerance=tolerance,
        clearance=clearance,
        tracking_tolerance=(tracking_tolerance,),
        deadline_ns=deadline,
        scope=scope,
        cover=cover,
        refine=refine,
        want_contacts=contacts,
        want_certificate=certificate is not None,
        check_joint_limits=not no_joint_limits,
        allow_nonzero_end_velocity=allow_end_velocity,
    )
    request = Request(
        urdf=urdf,
        scenes=scene,
        scene_pose=scene_pose,
        settings=settings,
        start=start or {},
        paths=trajectories,
        self_collision=not no_self_collision,
        certificate=certificate,
    )
    raise typer.Exit(run(request, json=json))


@app.command()
def replay(
    bags: Annotated[
        list[Path], typer.Argument(metavar='BAG', help='Folder of a bag, or .mcap or .db3 file.')
    ],
    urdf: options.Urdf,
    scene: options.Scenes,
    topic: options.Topics = None,
    joint_states: options.JointStates = None,
    scene_pose: options.ScenePose = None,
    tolerance: options.Tolerance = _DEFAULTS.tolerance,
    clearance: options.Clearance = _DEFAULTS.clearance,
    tracking_tolerance: options.TrackingTolerance = _DEFAULTS.tracking_tolerance[0],
    start: options.Start = None,
    no_self_collision: options.NoSelfCollision = False,
    no_joint_limits: options.NoJointLimits = False,
    allow_end_velocity: options.AllowEndVelocity = False,
    deadline: options.Deadline = None,
    scope: options.ScopeOption = _DEFAULTS.scope,
    cover: options.CoverOption = _DEFAULTS.cover,
    refine: options.Refine = _DEFAULTS.refine,
    contacts: options.Contacts = False,
    certificate: options.Certificate = None,
    json: options.Json = False,
) -> None:
    """Certify recorded trajectories, each from the joint state measured last before it."""
    settings = _settings(
        tolerance=tolerance,
        clearance=clearance,
        tracking_tolerance=(tracking_tolerance,),
        deadline_ns=deadline,
        scope=scope,
        cover=cover,
        refine=refine,
        want_contacts=contacts,
        want_certificate=certificate is not None,
        check_joint_limits=not no_joint_limits,
        allow_nonzero_end_velocity=allow_end_velocity,
    )
    request = Request(
        urdf=urdf,
        scenes=scene,
        scene_pose=scene_pose,
        settings=settings,
        start=start or {},
        paths=bags,
        topics=topic or (),
        joint_state_topics=joint_states or (),
        bags_only=True,
        self_collision=not no_self_collision,
        certificate=certificate,
    )
    raise typer.Exit(run(request, json=json))


def _settings(**values: Any) -> Settings:
    """Return the settings; options that do not go together are an error of usage."""
    try:
        return Settings(**values)
    except RequestError as error:
        raise typer.BadParameter(str(error)) from error


@app.command()
def verify(
    certificates: Annotated[
        list[Path],
        typer.Argument(metavar='CERTIFICATE', help='JSON file, or a folder of such files.'),
    ],
    urdf: options.Urdf,
    scene: options.Scenes,
    trajectory: options.Trajectories,
    scene_pose: options.ScenePose = None,
    json: options.Json = False,
) -> None:
    """
    Prove again what certificates claim, without the code that made them.

    Exit codes: 0 every certificate holds, 1 one does not, 2 bad input, 3 internal error.
    """
    verification = Verification(
        urdf=urdf,
        scenes=scene,
        scene_pose=scene_pose,
        certificates=certificates,
        trajectories=trajectory,
    )
    raise typer.Exit(run_verify(verification, json=json))
