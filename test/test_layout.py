"""What Python and the headers call by the same name is the same."""

import ctypes

import kernel_calls
import numpy as np
import pytest

from trajectory_guard.kernels import layout
from trajectory_guard.result import Status
from trajectory_guard.settings import Scope

VALUES = kernel_calls.layout_values()

# Names of ``layout`` that are values of the headers.
SHARED = sorted(
    name for name, value in vars(layout).items() if name in VALUES and isinstance(value, int)
)

RECORDS = {
    'Leaf': layout.LEAF,
    'Piece': layout.PIECE,
    'Entry': layout.ENTRY,
    'Opened': layout.OPENED,
    'Wanted': layout.WANTED,
}
# What the leaf's `known` calls otherwise.
KNOWN = {'y0': 'start', 'y1': 'end'}

STRUCTURES = {
    'Chain': layout._Chain,
    'Solids': layout._Solids,
    'Boxes': layout._Boxes,
    'Path': layout.PathStructure,
    'Floating': layout._Floating,
    'Extents': layout._Extents,
    'Request': layout.Request,
    'Answer': layout.Answer,
    'Piece': layout.Piece,
}


@pytest.mark.parametrize('name', SHARED)
def test_constants_agree(name):
    """A number has one value on both sides."""
    assert getattr(layout, name) == VALUES[name]


def test_no_constant_is_forgotten():
    """Every plain number of the layout is compared, but how Python asks for a motion."""
    plain = {
        name
        for name, value in vars(layout).items()
        if name.isupper() and isinstance(value, int | float)
    }
    assert plain - set(SHARED) == {'UP', 'ECONOMISED', 'RATIONAL'}
    assert layout.UP == 1.0 + VALUES['UP'] * 2.0**-52
    assert kernel_calls.CONTROLS == VALUES['CONTROLS']
    assert kernel_calls.CONTROL_ROW == VALUES['CONTROL_ROW']
    assert kernel_calls.ROUNDS == VALUES['ROUNDS']
    assert kernel_calls.RELATIVE == 1.0 / VALUES['1/RELATIVE']
    assert kernel_calls.LARGEST_ANGLE == VALUES['16 LARGEST_ANGLE'] / 16.0


@pytest.mark.parametrize('status', [s for s in Status if s])
def test_statuses_agree(status):
    """A leaf's status is the result's; zero is nobody's."""
    assert VALUES[status.name] == status != VALUES['UNDECIDED'] == 0


@pytest.mark.parametrize('scope', Scope)
def test_scopes_agree(scope):
    """A request's scope is the settings'."""
    assert VALUES[f'SCOPE_{scope.name}'] == scope


@pytest.mark.parametrize('name', RECORDS)
def test_records_agree(name):
    """Every field of an array that kernels write has the place that the header gives it."""
    record = RECORDS[name]
    assert record.itemsize == VALUES[name]
    for field in record.names:
        if f'{name}.{field}' in VALUES:
            offset = VALUES[f'{name}.{field}']
        else:
            offset = VALUES['Leaf.known'] + VALUES[f'Known.{KNOWN.get(field, field)}']
        assert record.fields[field][1] == offset
        assert record.fields[field][0].base in (np.dtype(np.int64), np.dtype(float))
    told = {key for key in VALUES if key.startswith((f'{name}.', 'Known.'))}
    assert len(record.names) == len(told) - 1 if name == 'Leaf' else len(told) - 7


@pytest.mark.parametrize('name', STRUCTURES)
def test_structures_agree(name):
    """Every field of a structure that kernels read lies where the header has it."""
    structure = STRUCTURES[name]
    assert ctypes.sizeof(structure) == VALUES[name]
    fields = [key.split('.')[1] for key in VALUES if key.startswith(f'{name}.')]
    assert fields == [field for field, _ in structure._fields_]
    for field in fields:
        assert getattr(structure, field).offset == VALUES[f'{name}.{field}']
