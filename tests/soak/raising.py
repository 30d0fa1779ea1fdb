"""A slave for PythonFMU that raises in the call which the environment variable RAISES names."""

import os
from functools import wraps

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


def may_raise(method):
    @wraps(method)
    def called(*arguments, **options):
        if os.environ.get("RAISES") == method.__name__:
            raise ValueError(f"raised in {method.__name__}")
        return method(*arguments, **options)

    return called


class Raising(Fmi2Slave):
    """One variable of each type; what it is asked for, PythonFMU's own methods do."""

    @may_raise
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.real, self.integer, self.boolean, self.string = 1.5, 2, True, "text"
        for kind in (Real, Integer, Boolean, String):
            variability = Fmi2Variability.continuous if kind is Real else Fmi2Variability.discrete
            name = kind.__name__.lower()
            self.register_variable(kind(name, causality=Fmi2Causality.input, variability=variability))

    @may_raise
    def do_step(self, current_time, step_size):  # noqa: ARG002 - PythonFMU calls it with both
        self.log("stepped")
        return True

    _fmu_state_to_bytes = staticmethod(may_raise(Fmi2Slave._fmu_state_to_bytes))
    _fmu_state_from_bytes = staticmethod(may_raise(Fmi2Slave._fmu_state_from_bytes))


for _name in (
    "setup_experiment", "enter_initialization_mode", "exit_initialization_mode", "terminate",
    "get_real", "get_integer", "get_boolean", "get_string",
    "set_real", "set_integer", "set_boolean", "set_string", "_get_fmu_state", "_set_fmu_state",
):  # fmt: skip
    setattr(Raising, _name, may_raise(getattr(Fmi2Slave, _name)))
