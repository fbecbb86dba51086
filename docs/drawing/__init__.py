"""Pictures of toleranced motions: one module a picture, each with a function `draw`."""
