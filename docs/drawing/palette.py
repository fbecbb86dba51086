"""Colours that all pictures share, told apart by any eye [Okabe, Ito 2008]."""

INK = '#222222'
FAINT = '#8a8a8a'
VERTEX = '#56b4e9'
EDGE = '#f0c84b'
FACE = '#7bc8a4'
OPEN = '#d55e00'
BODY = '#c8c8c8'
