"""Why no more is to be had: of stages that are less than three times as fast as plain C."""

LIMITS: dict[str, str] = {}
