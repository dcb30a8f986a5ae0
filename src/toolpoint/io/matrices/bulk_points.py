"""Grid points of bulk data, in rectangular coordinate systems, and their ties: RBE2, RBE3, RBAR, MPC."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.bodies.grid.tie import WAYS, MeanLeaders, TieEquation, mean_ties, rigid_ties
from toolpoint.io.matrices.bulk_cards import BulkCard
from toolpoint.vibration import Dof

Places = Mapping[int, FloatArray]
TIE_KEYWORDS = ("RBE2", "RBE3", "RBAR", "MPC")


def read_places(grids: Iterable[BulkCard], systems: Iterable[BulkCard]) -> dict[int, FloatArray]:
    """Return the places of grid points in the basic system; CORD2R systems of the basic one are followed."""
    frames = {card.whole(1): _frame(card) for card in systems}
    places = {}
    for card in grids:
        system, place = card.whole(2, 0), np.array(card.reals((3, 4, 5)))
        if card.whole(6, 0):
            card.refuse(f"motion in coordinate system {card.whole(6)}", "must be in the basic one (0)")
        if system:
            if system not in frames:
                card.refuse(f"coordinate system {system}", "must be the basic one (0) or a CORD2R of this file")
            axes, origin = frames[system]
            place = origin + place @ axes
        places[card.whole(1)] = place
    return places


def _frame(card: BulkCard) -> tuple[FloatArray, FloatArray]:
    """Return axes (3, 3) in rows and origin of a CORD2R: origin A, a point B of its z axis, a point C of its x z plane."""
    if card.whole(2, 0):
        card.refuse(f"stands in system {card.whole(2)}", "must stand in the basic one (0)")
    a, b, c = np.array(card.reals(range(3, 12))).reshape(3, 3)
    z = (b - a) / np.linalg.norm(b - a)
    x = (c - a) - ((c - a) @ z) * z
    if not np.linalg.norm(x) > 0:
        card.refuse("its three points lie on a line", "must span a plane")
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z]), a


def place_of(card: BulkCard, point: int, places: Places) -> FloatArray:
    """Return the place of a grid point that a card names."""
    if point not in places:
        card.refuse(f"grid point {point}", "must be a GRID of this file")
    return places[point]


def ways_of(card: BulkCard, word: str) -> tuple[int, ...]:
    """Return the ways 0 .. 5 of a word such as 123456."""
    if not word or set(word) - set("123456"):
        card.refuse(f"components {word!r}", "must be of the digits 1 to 6")
    return tuple(sorted({int(letter) - 1 for letter in word}))


def read_tie(card: BulkCard, places: Places) -> list[TieEquation]:
    """Return the equations of a tie."""
    try:
        return {"RBE2": _rigid_element, "RBE3": _mean_element, "RBAR": _rigid_bar, "MPC": _equation}[card.keyword](card, places)
    except ToolpointError as error:
        raise card.with_line(error) from None


def _rigid_element(card: BulkCard, places: Places) -> list[TieEquation]:
    followers = []
    for word in card.words(4):
        if "." in word:  # the coefficient of thermal expansion ends the list
            break
        followers.append(card.whole_of(word))
    for point in (card.whole(2), *followers):
        place_of(card, point, places)
    return rigid_ties(places, card.whole(2), followers, ways=ways_of(card, card.word(3)))


def _rigid_bar(card: BulkCard, places: Places) -> list[TieEquation]:
    ends, leading = (card.whole(2), card.whole(3)), (card.word(4), card.word(5))
    for point in ends:
        place_of(card, point, places)
    if sorted(leading) != ["", "123456"]:
        card.refuse(f"independent components {leading[0] or '-'} and {leading[1] or '-'}", "must be all six of one end")
    leader, follower = ends if leading[0] else ends[::-1]
    following = card.word(7) if leading[0] else card.word(6)
    return rigid_ties(places, leader, [follower], ways=ways_of(card, following or "123456"))


def _mean_element(card: BulkCard, places: Places) -> list[TieEquation]:
    """Read an RBE3: groups of a weight, its components, and points, which end at UM or ALPHA."""
    follower, ways = card.whole(3), ways_of(card, card.word(4))
    place_of(card, follower, places)
    groups: list[MeanLeaders] = []
    words = card.words(5)
    k = 0
    while k < len(words):
        if words[k].upper() == "UM":
            card.refuse("UM, followers among the leaders", "must be left out: the reference point follows")
        if words[k].upper() == "ALPHA":
            break
        weight = BulkCard(card.path, card.line, (card.keyword, words[k])).real(1)
        points = []
        counted = ways_of(card, words[k + 1] if k + 1 < len(words) else "")
        k += 2
        while k < len(words) and words[k].isdigit():
            points.append(card.whole_of(words[k]))
            place_of(card, points[-1], places)
            k += 1
        groups.append(MeanLeaders(weight, counted, tuple(points)))
    if not any(group.points for group in groups):
        card.refuse("no points to follow", "must name them")
    return mean_ties(places, follower, ways, leaders=groups)


def _equation(card: BulkCard, places: Places) -> list[TieEquation]:
    """Read an MPC: its first term follows the others."""
    terms = []
    # Three fields a term, two terms a line; the last field of a line and the first of the next are blank.
    for start in range(0, len(card.fields), 8):
        for k in (start + 2, start + 5):
            if card.word(k):
                point, way = card.whole(k), card.whole(k + 1, 0)
                terms.append((Dof(point, WAYS[max(way - 1, 0)]), card.real(k + 2)))
    if len(terms) < 2 or terms[0][1] == 0:
        card.refuse(f"{len(terms)} terms", "must be two or more, the first of a coefficient that is not 0")
    (follower, first), *others = terms
    return [TieEquation(follower, {dof: -value / first for dof, value in others})]
