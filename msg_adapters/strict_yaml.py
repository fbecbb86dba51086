"""
YAML to plain values, for files from strangers.

Smaller than YAML on purpose: no aliases (a few lines of them unfold to gigabytes), no tags, no
repeated keys (the last one would win unseen), no base-60 or octal numbers, bounded depth. Numbers
are read as JSON reads them, so ``1e-5`` is one, which YAML 1.1 takes for a string.
"""

import re
from typing import Any

import yaml

MAX_DEPTH = 16

_INTEGER = re.compile(r'[-+]?[0-9]{1,64}')
_DECIMAL = re.compile(
    r'[-+]?(?:[0-9]{1,64}(?:\.[0-9]{0,64})?|\.[0-9]{1,64})(?:[eE][-+]?[0-9]{1,8})?'
)
_WORDS = {
    '': None,
    '~': None,
    'null': None,
    'true': True,
    'True': True,
    'false': False,
    'False': False,
    '.nan': float('nan'),
    '.NaN': float('nan'),
    '.inf': float('inf'),
    '+.inf': float('inf'),
    '-.inf': float('-inf'),
}
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class StrictYamlError(ValueError):
    """
    The text is not YAML, or uses what is refused here.

    :param problem: what is wrong.
    :param mark: where, if it is known.
    """

    def __init__(self, problem: str, mark: Any = None) -> None:
        super().__init__(problem)
        self.line = None if mark is None else mark.line + 1


def plain_value(text: str) -> Any:
    """
    Return the single document in a text as dicts, lists, strings, numbers, booleans and None.

    :param text: one YAML document; an empty one is None.
    :raises StrictYamlError: as the module says; its line counts from the start of the text.
    """
    try:
        return _document(yaml.parse(text, Loader=_LOADER))
    except yaml.MarkedYAMLError as error:
        raise StrictYamlError(error.problem, error.problem_mark) from error
    except yaml.reader.ReaderError as error:
        raise StrictYamlError(f'character {error.position + 1}: {error.reason}') from error
    except (yaml.YAMLError, UnicodeError) as error:
        raise StrictYamlError(' '.join(str(error).split())) from error


def _document(events: Any) -> Any:
    """Return the value of the only document in the stream."""
    value = None
    documents = 0
    for event in events:
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise StrictYamlError('a second document', event.start_mark)
        elif isinstance(event, yaml.NodeEvent):
            value = _node(event, events, 0)
    return value


def _node(event: Any, events: Any, depth: int) -> Any:
    """
    Return the value that starts with an event, taking the events that belong to it.

    :param event: first event of the node.
    :param events: the events after it.
    :param depth: how many lists and mappings it lies in.
    """
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
        raise StrictYamlError('anchors and aliases are not supported', event.start_mark)
    if event.tag is not None:
        raise StrictYamlError(f'tags are not supported, found {event.tag!r}', event.start_mark)
    if isinstance(event, yaml.ScalarEvent):
        return _scalar(event.value) if event.implicit[0] else event.value
    if depth == MAX_DEPTH:
        raise StrictYamlError(f'nested deeper than {MAX_DEPTH}', event.start_mark)
    if isinstance(event, yaml.SequenceStartEvent):
        return _sequence(events, depth + 1)
    return _mapping(events, depth + 1)


def _sequence(events: Any, depth: int) -> list:
    """Return the list whose start was just read."""
    values = []
    for event in events:
        if isinstance(event, yaml.SequenceEndEvent):
            break
        values.append(_node(event, events, depth))
    return values


def _mapping(events: Any, depth: int) -> dict:
    """Return the mapping whose start was just read."""
    values: dict = {}
    for event in events:
        if isinstance(event, yaml.MappingEndEvent):
            break
        key = _node(event, events, depth) if isinstance(event, yaml.ScalarEvent) else None
        if not isinstance(key, str):
            raise StrictYamlError('a key must be a string', event.start_mark)
        if key in values:
            raise StrictYamlError(f'the key {key!r} is repeated', event.start_mark)
        values[key] = _node(next(events), events, depth)
    return values


def _scalar(text: str) -> Any:
    """Return the value of an unquoted scalar."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _DECIMAL.fullmatch(text):
        return float(text)
    return text
