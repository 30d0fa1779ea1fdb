"""A host of the WebAssembly component, on wasmtime, with the words of the FMI 3.0 host: what differs is here.

FMI-LS-WASM has a function's results as its answer, and a status in their place where it fails.
"""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import wasmtime
from wasmtime import component as wasm

from tests.harness.host import OK, Fmu, Message
from tests.harness.host3 import Instance3, Step

STATUSES = ("ok", "warning", "discard", "error", "fatal")
LOG = "fmi:fmi3/callbacks@3.0.0"


class ComponentFmu:
    """A component, and the FMU whose description tells its variables."""

    def __init__(self, content: bytes, described: Fmu) -> None:
        self.described = described
        self.engine = wasmtime.Engine()
        self.component = wasm.Component(self.engine, content)

    def imports(self) -> set[str]:
        return set(self.component.type.imports(self.engine))

    def exports(self) -> set[str]:
        return set(self.component.type.exports(self.engine))

    def run(self, memory: int = 1 << 30) -> Running:
        return Running(self, memory)

    def instance(self, name: str = "linkage", **options: Any) -> ComponentInstance:
        """A new instance in a memory of its own."""
        return ComponentInstance(self.run(), name, **options)


class Running:
    """The component in a memory of its own, which may hold many instances. memory: its most, in bytes."""

    def __init__(self, fmu: ComponentFmu, memory: int) -> None:
        self.fmu = fmu
        self.logged: list[tuple[str, str, str, str]] = []
        self.store = wasmtime.Store(fmu.engine)
        self.store.set_limits(memory_size=memory)
        linker = wasm.Linker(fmu.engine)
        with linker.root() as root, root.add_instance(LOG) as callbacks:
            callbacks.add_func("log-message", lambda _, *words: self.logged.append(words))
        self._instance = linker.instantiate(self.store, fmu.component)
        self._functions: dict[str, wasm.Func] = {}

    def call(self, interface: str, function: str, *arguments: Any) -> Any:
        name = f"fmi:fmi3/{interface}@3.0.0"
        if function not in self._functions:
            place = self._instance.get_export_index(self.store, name)
            index = self._instance.get_export_index(self.store, function, place)
            assert index is not None, f"{name} has no {function}"
            self._functions[function] = self._instance.get_func(self.store, index)
            kind = self._functions[function].type(self.store)  # asked for in each call
            self._functions[function].type = lambda _: kind
        found = self._functions[function](self.store, *arguments)
        self._functions[function].post_return(self.store)
        return found


def is_status(answer: Any) -> bool:
    return isinstance(answer, str) and answer in STATUSES


class ComponentInstance(Instance3):
    """One instance, without the functions that the draft has merged or dropped."""

    def __init__(
        self,
        running: Running,
        name: str = "linkage",
        *,
        logging: bool = True,
        guid: str | None = None,
        model_exchange: bool = False,
        event_mode: bool = False,
        early_return: bool = False,
        required: Sequence[str | int] = (),
    ) -> None:
        self.fmu = running.fmu.described
        self.model_exchange = model_exchange
        self.running = running
        self._start: tuple[float, float | None] = (0.0, None)
        self._kind = "model-exchange" if model_exchange else "co-simulation"
        token = self.fmu.description.guid if guid is None else guid
        only = () if model_exchange else (event_mode, early_return, list(self.references(required)))
        factory = f"[static]{self._kind}-instance.instantiate-{self._kind}"
        self.component = running.call(self._kind, factory, name, token, False, logging, *only)

    @property
    def messages(self) -> list[Message]:
        return [
            Message(name, STATUSES.index(status), category, text)
            for name, status, category, text in self.running.logged
        ]

    def method(self, name: str, *arguments: Any) -> Any:
        """What the draft's method of this name answers."""
        return self.running.call(self._kind, f"[method]{self._kind}-instance.{name}", self.component, *arguments)

    def _values(self, name: str, *arguments: Any) -> tuple[int, list[float]]:
        """Status and values; NaN where there are none."""
        answer = self.method(name, *arguments)
        if is_status(answer):
            return STATUSES.index(answer), [math.nan]
        return OK, answer

    def free(self) -> None:
        if self.component is not None:
            self.component.drop(self.running.store)
            self.component = None

    def call(self, function: str, *arguments: Any) -> int:
        """Functions that take something in and give nothing but their status, by their names in C."""
        name = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", function.removeprefix("fmi2").removeprefix("fmi3")).lower()
        if name == "enter-initialization-mode":
            arguments = (None, *self._start)
        counts = [k + 1 for k, argument in enumerate(arguments) if isinstance(argument, ctypes.Array)]
        lists = [list(a) if isinstance(a, ctypes.Array) else a for k, a in enumerate(arguments) if k not in counts]
        return STATUSES.index(self.method(name, *lists))

    def try_set(self, values: Mapping[str | int, float | bool]) -> int:
        for name, kind in (("set-boolean", True), ("set-float64", False)):
            chosen = {of: value for of, value in values.items() if isinstance(value, bool) == kind}
            if chosen:
                status = STATUSES.index(self.method(name, list(self.references(chosen)), list(chosen.values())))
                if status != OK:
                    return status
        return OK

    def try_get(self, names: Iterable[str | int]) -> tuple[int, list[float]]:
        return self._values("get-float64", list(self.references(names)))

    def get_boolean(self, name: str) -> bool:
        (value,) = self.method("get-boolean", list(self.references([name])))
        return value

    def do_step(self, time: float, step: float) -> Step:
        answer = self.method("do-step", time, step, True)
        if is_status(answer):
            return Step(STATUSES.index(answer), False, False, False, math.nan)
        told = vars(answer)
        return Step(OK, told["event-handling-needed"], told["terminate-simulation"], told["early-return"],
                    told["last-successful-time"])  # fmt: skip

    def try_get_derivatives(self, *wanted: tuple[str | int, int]) -> tuple[int, list[float]]:
        references = self.references(name for name, _ in wanted)
        return self._values("get-output-derivatives", [*zip(references, (order for _, order in wanted), strict=True)])

    def _derivative(self, function: str, unknowns: list, knowns: list, seed: list[float]) -> tuple[int, list[float]]:
        name = "get-adjoint-derivative" if "Adjoint" in function else "get-directional-derivative"
        return self._values(name, list(self.references(unknowns)), list(self.references(knowns)), seed)

    def serialize(self) -> bytes:
        answer = self.method("get-fmu-state")
        assert not is_status(answer), self.messages[-1].text
        return answer

    def deserialize(self, serialized: bytes) -> ComponentInstance:
        self.demand(STATUSES.index(self.method("set-fmu-state", serialized)), "set-fmu-state")
        return self
