"""Bytes given to fmi2DeSerializeFMUstate that no component has written, by the thousand."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Iterable
from ctypes import byref

from scenarios.common.instance import ERROR, OK, Instance, UnpackedFmu
from scenarios.speed_vs_error.hard_cases.driving import HEADER, begin, between_steps, fnv1a, tell
from scenarios.speed_vs_error.hard_cases.measured import Measured, Worst

BLOBS, FORGED = 4000, 2000
ODD_WORDS = (0.0, -0.0, 5e-324, 1.0, -1.0, 1e-300, 1e60, -1e60, 1e154, 1e300, -1e308, math.inf, -math.inf, math.nan)


def measure(fmu: UnpackedFmu) -> list[Measured]:
    return [*foreign(fmu), *forged(fmu)]


def blob(chance: random.Random, right: bytes, other: bytes) -> tuple[str, bytes]:
    """Bytes that are no state, and what they are. `other` is another state of the same component."""
    cut = chance.randrange(1, len(right))
    damaged = bytearray(right)
    for _ in range(chance.choice([1, 1, 2, 8, 64])):
        damaged[chance.randrange(len(right))] ^= 1 << chance.randrange(8)
    kinds = {
        "random bytes": chance.randbytes(len(right)),
        "random bytes of any length": chance.randbytes(chance.randrange(2 * len(right))),
        "random after the header": right[:HEADER] + chance.randbytes(len(right) - HEADER),
        "truncated": right[:cut],
        "truncated and filled up": right[:cut] + bytes(len(right) - cut),
        "too long": right + chance.randbytes(chance.randrange(1, 64)),
        "flipped bits": bytes(damaged),
        "two states spliced": right[:cut] + other[cut:],
        "shifted": right[1:] + right[:1],
        "an archive": (b"PK\3\4" + chance.randbytes(60)) * (len(right) // 64 + 1),
    }
    name = chance.choice(list(kinds))
    return name, kinds[name]


def foreign(fmu: UnpackedFmu) -> Iterable[Measured]:
    chance, accepted, changed = random.Random(3), Worst(), 0
    with between_steps(Instance(fmu, "reader")) as reader, Instance(fmu, "other") as writer:
        right = reader.serialize()
        tell(begin(writer), 0, 12)
        other = writer.serialize()
        for _ in range(BLOBS):
            kind, content = blob(chance, right, other)
            if content in (right, other):  # spliced in a place where they agree
                continue
            status, state = reader.try_deserialize(content)
            if status != ERROR or state:
                accepted.see(accepted.value + 1, kind)
        changed += reader.serialize() != right
    yield Measured(
        f"{BLOBS} blobs: random, truncated, damaged, foreign", "accepted", "blobs", accepted.value, 0, accepted.where
    )
    yield Measured(f"{BLOBS} blobs: random, truncated, damaged, foreign", "instances changed", "instances", changed, 0)


def forged(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Content that nobody saved, with the right header and checksum: refused, or followed by numbers or a refusal."""
    chance, nonsense, taken = random.Random(4), Worst(), 0
    with Instance(fmu, "writer") as writer:
        tell(begin(writer), 0, 12)
        right = writer.serialize()
    with between_steps(Instance(fmu, "reader")) as reader:
        outputs = fmu.names("output")
        for _ in range(FORGED):
            content = bytearray(right)
            places = [
                HEADER + 8 * chance.randrange((len(right) - HEADER) // 8) for _ in range(chance.choice([1, 1, 2, 5]))
            ]
            for place in places:
                value = struct.pack("<d", chance.choice(ODD_WORDS))
                content[place : place + 8] = chance.choice(
                    [value, chance.randbytes(8), struct.pack("<q", chance.randrange(-9, 9))]
                )
            content[HEADER - 8 : HEADER] = fnv1a(content[HEADER:]).to_bytes(8, "little")
            status, state = reader.try_deserialize(bytes(content))
            if status != OK:
                continue
            taken += 1
            reader.restore(state)
            for found in after_restoring(reader, outputs):
                if not all(map(math.isfinite, found)):
                    nonsense.see(nonsense.value + 1, f"word {[(place - HEADER) // 8 for place in places]}")
            reader.call("fmi2FreeFMUstate", byref(state))
    yield Measured(
        f"{FORGED} forged states with the right checksum",
        f"answers that are no numbers ({taken} were taken)",
        "answers",
        nonsense.value,
        0,
        nonsense.where,
    )


def after_restoring(reader: Instance, outputs: list[str]) -> Iterable[list[float]]:
    """What is read, where the status says that it may be believed; before and after a step."""
    for _ in range(2):
        status, found = reader.try_get(outputs)
        if status == OK:
            yield found
        status, found = reader.try_get_derivatives(*[(name, 2) for name in outputs])
        if status == OK:
            yield found
        status, found = reader.try_sensitivity(outputs, {"crank.phi": 1.0, "crank.w": -1.0})
        if status == OK:
            yield found
        reader.try_step(reader.try_get(["time"])[1][0], 0.01)
