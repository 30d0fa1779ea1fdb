"""Equations (1) to (25) of the paper as printed, and mended where the print is wrong.

Chen, Wang, Ren, Huang (2010), DOI 10.3969/j.issn.1000-1298.2010.12.010. They are here to be tested, not used.

`g` holds the paper's table 1 and `s` the state, both under the paper's names: phi, phi2 ... phi9 are angles
(phi counted counter-clockwise as printed, hence negative in work), X_A, Y_A ... coordinates; dphi3, dX_E are
first and ddphi3, ddX_E second derivatives by time. The only liberty is the sign of YC and YG, which comes with
`g`. A function returns what stands left of the equals sign; equations that give a point twice, by two chains
of links, return both. Numbers are mpmath's, at its working precision: 53 bits are double arithmetic, many
more show what an equation says when nothing is rounded.
"""

from __future__ import annotations

from types import SimpleNamespace

from mpmath import acos, atan, atan2, cos, mpf, pi, sin, sqrt, tan

Values = SimpleNamespace  # geometry or state, by the paper's names


def equation_1(g: Values, s: Values) -> tuple[mpf, mpf]:
    """X_A, Y_A"""
    return g.L1 * cos(g.phi1 + s.phi), g.L1 * sin(g.phi1 + s.phi)


def equation_2(g: Values, s: Values) -> tuple[mpf, mpf]:
    """X_D, Y_D"""
    return g.XC + g.L4 * cos(g.phi4 + s.phi), g.YC + g.L4 * sin(g.phi4 + s.phi)


def equation_3(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """X_B, Y_B by A, then by D"""
    return (
        g.L1 * cos(g.phi1 + s.phi) + g.L2 * cos(s.phi2),
        g.L1 * sin(g.phi1 + s.phi) + g.L2 * sin(s.phi2),
        g.XC + g.L4 * cos(g.phi4 + s.phi) + g.L3 * cos(s.phi3),
        g.YC + g.L4 * sin(g.phi4 + s.phi) + g.L3 * sin(s.phi3),
    )


def abbreviations_4(g: Values, s: Values) -> tuple[mpf, mpf, mpf]:
    """a, b, c"""
    a = g.XC + g.L4 * cos(g.phi4 + s.phi) - g.L1 * cos(g.phi1 + s.phi)
    b = g.YC + g.L4 * sin(g.phi4 + s.phi) - g.L1 * sin(g.phi1 + s.phi)
    return a, b, (a**2 + b**2 + g.L3**2 - g.L2**2) / (2 * g.L3)


def equation_4(g: Values, s: Values) -> mpf:
    """phi3"""
    a, b, c = abbreviations_4(g, s)
    return 2 * atan((b - sqrt(a**2 + b**2 - c**2)) / (a - c))


def equation_5(g: Values, s: Values) -> tuple[mpf, mpf]:
    """X_E, Y_E"""
    phi5 = s.phi3 - g.theta3
    return s.X_D + g.L5 * cos(phi5), s.Y_D + g.L5 * sin(phi5)


def equation_6(g: Values, s: Values) -> mpf:
    """phi7"""
    square = (g.XG - s.X_E) ** 2 + (g.YG - s.Y_E) ** 2
    alpha = acos((square + g.L7**2 - g.L6**2) / (2 * g.L7 * sqrt(square)))
    theta = atan2(s.Y_E - g.YG, s.X_E - g.XG)
    return alpha + theta


def equation_7(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """X_F, Y_F by E, then by G"""
    return (
        s.X_E + g.L6 * cos(s.phi6),
        s.Y_E + g.L6 * sin(s.phi6),
        g.XG + g.L7 * cos(s.phi7),
        g.YG + g.L7 * sin(s.phi7),
    )


def equation_8(g: Values, s: Values) -> tuple[mpf, mpf]:
    """X_J, Y_J"""
    return s.X_H + g.L8 * cos(s.phi8) + g.L9 * cos(s.phi9), s.Y_H + g.L8 * sin(s.phi8) + g.L9 * sin(s.phi9)


def equation_9(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """dX_B, dY_B by D, then by A"""
    return (
        -g.L4 * s.dphi4 * sin(g.phi4 + s.phi) - g.L3 * s.dphi3 * sin(s.phi3),
        g.L4 * s.dphi4 * cos(g.phi4 + s.phi) + g.L3 * s.dphi3 * cos(s.phi3),
        -g.L1 * s.dphi1 * sin(g.phi1 + s.phi) - g.L2 * s.dphi2 * sin(s.phi2),
        g.L1 * s.dphi1 * cos(g.phi1 + s.phi) + g.L2 * s.dphi2 * cos(s.phi2),
    )


def equation_10(g: Values, s: Values) -> mpf:
    """dphi2"""
    return _equation_10(g, s, s.dphi3)


def equation_10_mended(g: Values, s: Values) -> mpf:
    """dphi2, with phi1' in the third term, where phi3' is printed"""
    return _equation_10(g, s, s.dphi1)


def _equation_10(g: Values, s: Values, third_rate: mpf) -> mpf:
    return (
        g.L1 * s.dphi1 * sin(g.phi1 + s.phi)
        - g.L4 * s.dphi4 * sin(g.phi4 + s.phi)
        - g.L1 * third_rate * cos(g.phi1 + s.phi) * tan(s.phi3)
        + g.L4 * s.dphi4 * cos(g.phi4 + s.phi) * tan(s.phi3)
    ) / (g.L2 * cos(s.phi2) * tan(s.phi3) - g.L2 * sin(s.phi2))


def equation_11(g: Values, s: Values) -> mpf:
    """dphi3"""
    return (
        g.L1 * s.dphi1 * sin(g.phi1 + s.phi) + g.L2 * s.dphi2 * sin(s.phi2) - g.L4 * s.dphi4 * sin(g.phi4 + s.phi)
    ) / (g.L3 * sin(s.phi3))


def equation_12(g: Values, s: Values) -> tuple[mpf, mpf]:
    """dX_E, dY_E"""
    return _equation_12(g, s, g.phi4)


def equation_12_mended(g: Values, s: Values) -> tuple[mpf, mpf]:
    """dX_E, dY_E, with phi4 + phi, where phi4 is printed"""
    return _equation_12(g, s, g.phi4 + s.phi)


def _equation_12(g: Values, s: Values, crank: mpf) -> tuple[mpf, mpf]:
    return (
        -g.L4 * s.dphi4 * sin(crank) - g.L5 * s.dphi3 * sin(s.phi5),
        g.L4 * s.dphi4 * cos(crank) + g.L5 * s.dphi3 * cos(s.phi5),
    )


def equation_13(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """dX_F, dY_F by E, then by G"""
    return (
        s.dX_E - g.L6 * s.dphi6 * sin(s.phi6),
        s.dY_E + g.L6 * s.dphi6 * cos(s.phi6),
        -g.L7 * s.dphi7 * sin(s.phi7),
        g.L7 * s.dphi7 * cos(s.phi7),
    )


def equation_14(g: Values, s: Values) -> mpf:
    """dphi6"""
    return (s.dX_E * cos(s.phi7) + s.dY_E * sin(s.phi7)) / (g.L6 * sin(s.phi6 - s.phi7))


def equation_15(g: Values, s: Values) -> mpf:
    """dphi7"""
    return (s.dX_E * cos(s.phi6) + s.dY_E * sin(s.phi6)) / (g.L7 * sin(s.phi6 - s.phi7))


def equation_16(g: Values, s: Values) -> tuple[mpf, mpf]:
    """dX_J, dY_J"""
    return (
        (s.dX_E + s.dX_F) / 2 - g.L8 * s.dphi6 * sin(s.phi8) - g.L9 * s.dphi6 * sin(s.phi9),
        (s.dY_E + s.dY_F) / 2 + g.L8 * s.dphi6 * cos(s.phi8) + g.L9 * s.dphi6 * cos(s.phi9),
    )


def equation_17(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """ddX_B, ddY_B by D, then by A"""
    return _equation_17(g, s, s.ddphi4)


def equation_17_mended(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """ddX_B, ddY_B by D, then by A, with phi4'^2, where phi4'' is printed"""
    return _equation_17(g, s, s.dphi4**2)


def _equation_17(g: Values, s: Values, crank: mpf) -> tuple[mpf, mpf, mpf, mpf]:
    return (
        -g.L4 * crank * cos(g.phi4 + s.phi) - g.L3 * s.ddphi3 * sin(s.phi3) - g.L3 * s.dphi3**2 * cos(s.phi3),
        -g.L4 * crank * sin(g.phi4 + s.phi) + g.L3 * s.ddphi3 * cos(s.phi3) - g.L3 * s.dphi3**2 * sin(s.phi3),
        -g.L1 * s.dphi1**2 * cos(g.phi1 + s.phi) - g.L2 * s.ddphi2 * sin(s.phi2) - g.L2 * s.dphi2**2 * cos(s.phi2),
        -g.L1 * s.dphi1**2 * sin(g.phi1 + s.phi) + g.L2 * s.ddphi2 * cos(s.phi2) - g.L2 * s.dphi2**2 * sin(s.phi2),
    )


def abbreviations_18(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """d, e, f, g"""
    return (
        -g.L4 * s.dphi4**2 * cos(g.phi4 + s.phi) - g.L3 * s.dphi3**2 * cos(s.phi3),
        -g.L1 * s.dphi1**2 * cos(g.phi1 + s.phi) - g.L2 * s.dphi2**2 * cos(s.phi2),
        -g.L4 * s.dphi4**2 * sin(g.phi4 + s.phi) - g.L3 * s.dphi3**2 * sin(s.phi3),
        -g.L1 * s.dphi1**2 * sin(g.phi1 + s.phi) - g.L2 * s.dphi2**2 * sin(s.phi2),
    )


def equation_18(g: Values, s: Values) -> mpf:
    """ddphi2"""
    d, e, f, g_ = abbreviations_18(g, s)
    return (e - d + (g_ - f) * tan(s.phi3)) / (g.L2 * sin(s.phi2) - g.L2 * cos(s.phi2) * tan(s.phi3))


def equation_19(g: Values, s: Values) -> mpf:
    """ddphi3"""
    d, e, f, g_ = abbreviations_18(g, s)
    return (e - d + (g_ - f) * tan(s.phi2)) / (g.L3 * cos(s.phi3) * tan(s.phi2) - g.L3 * sin(s.phi3))


def equation_20(g: Values, s: Values) -> tuple[mpf, mpf]:
    """ddX_E, ddY_E"""
    return _equation_20(g, s, g.phi4, s.ddphi4)


def equation_20_mended(g: Values, s: Values) -> tuple[mpf, mpf]:
    """ddX_E, ddY_E, with phi4 + phi and phi4'^2, where phi4 and phi4'' are printed"""
    return _equation_20(g, s, g.phi4 + s.phi, s.dphi4**2)


def equation_20_half_mended(g: Values, s: Values) -> tuple[mpf, mpf]:
    """ddX_E, ddY_E, with phi4'^2 but phi4 alone: one of the two slips does not explain the other"""
    return _equation_20(g, s, g.phi4, s.dphi4**2)


def _equation_20(g: Values, s: Values, angle: mpf, crank: mpf) -> tuple[mpf, mpf]:
    return (
        -g.L4 * crank * cos(angle) - g.L5 * s.ddphi3 * sin(s.phi5) - g.L5 * s.dphi3**2 * cos(s.phi5),
        -g.L4 * crank * sin(angle) + g.L5 * s.ddphi3 * cos(s.phi5) - g.L5 * s.dphi3**2 * sin(s.phi5),
    )


def equation_21(g: Values, s: Values) -> tuple[mpf, mpf, mpf, mpf]:
    """ddX_F, ddY_F by E, then by G"""
    return (
        s.ddX_E - g.L6 * s.ddphi6 * sin(s.phi6) - g.L6 * s.dphi6**2 * cos(s.phi6),
        s.ddY_E + g.L6 * s.ddphi6 * cos(s.phi6) - g.L6 * s.dphi6**2 * sin(s.phi6),
        -g.L7 * s.ddphi7 * sin(s.phi7) - g.L7 * s.dphi7**2 * cos(s.phi7),
        g.L7 * s.ddphi7 * cos(s.phi7) - g.L7 * s.dphi7**2 * sin(s.phi7),
    )


def equation_22(g: Values, s: Values) -> mpf:
    """ddphi6"""
    return (
        s.ddX_E * cos(s.phi7) + s.ddY_E * sin(s.phi7) - g.L6 * s.dphi6**2 * cos(s.phi6 - s.phi7) + g.L7 * s.dphi7**2
    ) / (g.L6 * sin(s.phi6 - s.phi7))


def equation_23(g: Values, s: Values) -> mpf:
    """ddphi7"""
    return _equation_23(g, s, cos(s.phi6 - s.phi7))


def equation_23_mended(g: Values, s: Values) -> mpf:
    """ddphi7, without the cosine that is printed on the term of L6"""
    return _equation_23(g, s, mpf(1))


def _equation_23(g: Values, s: Values, factor: mpf) -> mpf:
    return (
        s.ddX_E * cos(s.phi6)
        + s.ddY_E * sin(s.phi6)
        - g.L6 * s.dphi6**2 * factor
        + g.L7 * s.dphi7**2 * cos(s.phi6 - s.phi7)
    ) / (g.L7 * sin(s.phi6 - s.phi7))


def equation_24(g: Values, s: Values) -> tuple[mpf, mpf]:
    """ddX_F, ddY_F"""
    return (
        -g.L7 * s.ddphi7 * sin(s.phi7) - g.L7 * s.dphi7**2 * cos(s.phi7),
        g.L7 * s.ddphi7 * cos(s.phi7) - g.L7 * s.dphi7**2 * sin(s.phi7),
    )


def equation_25(g: Values, s: Values) -> tuple[mpf, mpf]:
    """ddX_J, ddY_J"""
    return (
        (s.ddX_E + s.ddX_F) / 2
        - g.L8 * s.ddphi6 * sin(s.phi8)
        - g.L8 * s.dphi6**2 * cos(s.phi8)
        - g.L9 * s.ddphi6 * sin(s.phi9)
        - g.L9 * s.dphi6**2 * cos(s.phi9),
        (s.ddY_E + s.ddY_F) / 2
        + g.L8 * s.ddphi6 * cos(s.phi8)
        - g.L8 * s.dphi6**2 * sin(s.phi8)
        + g.L9 * s.ddphi6 * cos(s.phi9)
        - g.L9 * s.dphi6**2 * sin(s.phi9),
    )


def mended_tip(g: Values, phi: float, speed: mpf) -> tuple[tuple[mpf, mpf], tuple[mpf, mpf], tuple[mpf, mpf]]:
    """X_J and Y_J with their first and second derivatives by time, by the equations one after the other, each
    mended where the print is wrong; phi counts in the working direction, in which the crank turns at `speed`.

    phi2, phi6 and the middle H of EF, for which nothing is printed, are taken from the joints.
    """
    s = Values(phi=-mpf(phi), dphi1=-speed, dphi4=-speed, ddphi4=mpf(0))
    (s.X_A, s.Y_A), (s.X_D, s.Y_D) = equation_1(g, s), equation_2(g, s)
    s.phi3, s.phi2 = equation_4(g, s), mpf(0)
    _, _, X_B, Y_B = equation_3(g, s)
    s.phi2 = atan2(Y_B - s.Y_A, X_B - s.X_A)
    s.phi5 = s.phi3 - g.theta3
    s.X_E, s.Y_E = equation_5(g, s)
    s.phi7, s.phi6 = equation_6(g, s), mpf(0)
    _, _, X_F, Y_F = equation_7(g, s)
    s.phi6 = atan2(Y_F - s.Y_E, X_F - s.X_E)
    s.phi8 = s.phi6 - pi + g.theta8
    s.phi9 = s.phi8 + g.theta9
    s.X_H, s.Y_H = (s.X_E + X_F) / 2, (s.Y_E + Y_F) / 2
    s.dphi2 = equation_10_mended(g, s)
    s.dphi3 = equation_11(g, s)
    s.dX_E, s.dY_E = equation_12_mended(g, s)
    s.dphi6, s.dphi7 = equation_14(g, s), equation_15(g, s)
    _, _, s.dX_F, s.dY_F = equation_13(g, s)
    s.ddphi3 = equation_19(g, s)
    s.ddX_E, s.ddY_E = equation_20_mended(g, s)
    s.ddphi6, s.ddphi7 = equation_22(g, s), equation_23_mended(g, s)
    s.ddX_F, s.ddY_F = equation_24(g, s)
    return equation_8(g, s), equation_16(g, s), equation_25(g, s)
