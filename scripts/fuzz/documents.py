"""Files made from the schemas: every type, bound and column as the readers know them."""

from __future__ import annotations

import json
import random
import warnings
from collections.abc import Iterator, Sequence
from typing import Any, Literal, get_args, get_origin

import msgspec
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from curling_env.infrastructure.files.table import Column


def strategies(rng: random.Random) -> dict[str, Iterator[bytes]]:
    """Endless files by the names that `targets` use."""
    from agents.planning.stones_file import StoneDocument
    from agents.playing.record_schema import DeliveryLine, HeadLine, ResultLine
    from curling_env.ice_form import IceDocument
    from curling_env.throw import RELEASE_TABLE
    from curling_env.trajectory import TRACK_TABLE
    from friction_estimation.camera.scene import LensDocument, SceneDocument
    from friction_estimation.donation.session import SessionDocument
    from friction_estimation.film.video import TIMES_TABLE

    ice = document(IceDocument).map(lambda d: {**d, "format": "curling-ice/1"})
    scene = document(SceneDocument).map(
        lambda d: _text({**d, "format": "curling-scene/1"}).encode()
    )
    game = st.tuples(
        document(HeadLine).map(lambda d: {**d, "format": "curling-game/1"}),
        st.lists(document(DeliveryLine), max_size=3),
        document(ResultLine),
    ).map(lambda g: "\n".join(_text(line) for line in (g[0], *g[1], g[2])).encode())
    made: dict[str, st.SearchStrategy[bytes]] = {
        "ice.json": ice.map(lambda d: _text(d).encode()),
        "full.json": ice.map(lambda d: _text(d).encode()),
        "s.json": scene,
        "hall.json": scene,
        "cam.json": document(LensDocument).map(lambda d: _text(d).encode()),
        "st.json": st.lists(document(StoneDocument), max_size=4).map(lambda d: _text(d).encode()),
        "session.json": document(SessionDocument).map(
            lambda d: _text({**d, "format": "curling-session/1"}).encode()
        ),
        "g.jsonl": game,
        "r.csv": table(RELEASE_TABLE),
        "t.csv": table(TRACK_TABLE),
        "f.mp4.times.csv": table(TIMES_TABLE),
    }
    return {name: _endless(strategy, rng.randrange(2**32)) for name, strategy in made.items()}


def document(form: Any) -> st.SearchStrategy[Any]:
    """Documents of a schema, some of which break it in one place or another."""
    return _good(form)


def table(columns: Sequence[Column]) -> st.SearchStrategy[bytes]:
    """Tables with these columns, as bytes of a CSV file."""
    cells = [
        st.one_of(
            st.integers(0, 5),
            st.floats(max(c.low, -10.0), min(c.high, 30.0), allow_nan=False),
            *([st.just("")] if not c.required else []),
        ).map(str)
        for c in columns
    ]
    # Times that increase and throws that stand together make most tables good ones.
    rows = st.lists(st.tuples(*cells), max_size=20)

    def lines(drawn: list[tuple[str, ...]]) -> bytes:
        names = [c.name for c in columns]
        text = [",".join(names)]
        for k, row in enumerate(drawn):
            ordered = (
                {"throw": str(k // 10), "t": f"{k % 10 / 5}"} if "t" in names else {"throw": str(k)}
            )
            text.append(",".join(ordered.get(n, v) for n, v in zip(names, row, strict=True)))
        return "\n".join(text).encode()

    return rows.map(lines)


def _endless(strategy: st.SearchStrategy[bytes], first: int) -> Iterator[bytes]:
    while True:
        found: list[bytes] = []

        @seed(first)
        @settings(
            max_examples=50,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),  # pyright: ignore[reportArgumentType]
        )
        @given(strategy)
        def draw(value: bytes) -> None:
            found.append(value)  # noqa: B023

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            draw()
        yield from found
        first += 1


def _good(form: Any) -> st.SearchStrategy[Any]:
    """Values of a type as msgspec knows it."""
    origin, inner = get_origin(form), get_args(form)
    bounds: dict[str, Any] = {}
    if hasattr(form, "__metadata__"):
        origin, form = None, inner[0]
        for meta in inner[1:]:
            bounds |= {
                key: getattr(meta, key)
                for key in ("ge", "le", "min_length", "max_length")
                if getattr(meta, key, None) is not None
            }
        if get_origin(form) is not None or isinstance(form, type) is False:
            inner_strategy = _collection(form, bounds)
            if inner_strategy is not None:
                return inner_strategy
    if isinstance(form, type) and issubclass(form, msgspec.Struct):
        required: dict[str, Any] = {}
        optional: dict[str, Any] = {}
        for field in msgspec.structs.fields(form):
            (required if field.required else optional)[field.name] = _good(field.type)
        return st.fixed_dictionaries(required, optional=optional)
    collection = _collection(form, bounds)
    if collection is not None:
        return collection
    if origin is Literal:
        return st.sampled_from(inner)
    if form is float:
        low, high = bounds.get("ge", -1e300), bounds.get("le", 1e300)
        return st.one_of(
            st.floats(low, high),
            st.floats(max(low, -50), min(high, 50)),
            st.sampled_from((low, high)),
        )
    if form is int:
        return st.integers(bounds.get("ge", 0), min(bounds.get("le", 2**40), 2**40))
    if form is bool:
        return st.booleans()
    if form is str:
        return st.text(max_size=20)
    if isinstance(form, type) and issubclass(form, str):  # an enumeration of names
        return st.sampled_from([member.value for member in form])  # pyright: ignore[reportGeneralTypeIssues]
    return st.one_of(st.none(), st.integers(), st.text(max_size=5))


def _collection(form: Any, bounds: dict[str, Any]) -> st.SearchStrategy[Any] | None:
    import types
    from typing import Union

    origin, inner = get_origin(form), get_args(form)
    if origin in (types.UnionType, Union):
        return st.one_of(*(_good(part) for part in inner))
    if form is type(None):
        return st.none()
    if origin is list:
        most = min(bounds.get("max_length", 4), 6)
        return st.lists(_good(inner[0]), min_size=bounds.get("min_length", 0), max_size=most)
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return st.lists(_good(inner[0]), max_size=3)
        return st.tuples(*(_good(part) for part in inner)).map(list)
    if origin is dict:
        return st.dictionaries(st.text(max_size=8), _good(inner[1]), max_size=3)
    return None


def _text(value: Any) -> str:
    return json.dumps(value)
