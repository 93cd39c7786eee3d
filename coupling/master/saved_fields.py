"""State by declared fields: a class names the fields that change in a step, and can be saved and restored.

    class Drum(SavedFields):
        STATE = ("length", "_turns")

A field holds numbers, truth values, texts, None, arrays, tuples, lists and dicts of them, a dataclass of them, or another part that has
`save_state` and `restore_state`. In the saved state a field has its name without leading underscores.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any, ClassVar

import numpy as np


class SavedFields:
    """A part of a run whose state is the fields that its class names in STATE; those in LOOSE may change their size and hold NaN."""

    STATE: ClassVar[tuple[str, ...]] = ()
    LOOSE: ClassVar[tuple[str, ...]] = ()

    def save_state(self) -> Any:
        """Return copies of all fields by name, as plain data."""
        return {name.lstrip("_"): _saved(getattr(self, name)) for name in self.STATE}

    def restore_state(self, state: Any) -> None:
        """Go back to what `save_state` returned, whole or not at all.

        Raises TypeError for another object, KeyError for a field that is missing, and ValueError for an array of another shape or type, and
        for numbers that are not finite.
        """
        who = getattr(self, "name", type(self).__name__)
        if not isinstance(state, Mapping):
            kind = type(state).__name__
            raise TypeError(f"{who!r}: restore_state got a {kind}, allowed: a state that save_state returned")
        found = {}
        for name in self.STATE:
            now, saved = getattr(self, name), state[name.lstrip("_")]
            if _parts(now):
                continue
            _check(f"{who!r}: saved {name.lstrip('_')!r}", now, saved, name in self.LOOSE)
            found[name] = _restored(now, saved)
        for name in self.STATE:
            if name in found:
                setattr(self, name, found[name])
                continue
            now, saved = getattr(self, name), state[name.lstrip("_")]
            several = isinstance(now, Mapping | list | tuple)
            if several and len(now) != len(saved):
                raise ValueError(f"{who!r}: saved {name.lstrip('_')!r} has {len(saved)} parts, allowed: {len(now)}")
            for key, part in _parts(now).items():
                part.restore_state(saved[key] if several else saved)


def _parts(value: Any) -> dict[Any, Any]:
    """Return the parts that restore themselves, by key or place; empty for other values."""
    if hasattr(value, "restore_state"):
        return {"": value}
    each = (
        dict(value) if isinstance(value, Mapping) else dict(enumerate(value)) if isinstance(value, list | tuple) else {}
    )
    return each if each and all(hasattr(one, "restore_state") for one in each.values()) else {}


def _saved(value: Any) -> Any:
    """Copy a field's value, deeply, as plain data."""
    if hasattr(value, "save_state"):
        return value.save_state()
    if is_dataclass(value) and not isinstance(value, type):
        return {name: _saved(one) for name, one in asdict(value).items()}
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, Mapping):
        return {name: _saved(one) for name, one in value.items()}
    if isinstance(value, set):
        return set(value)
    if isinstance(value, tuple | list):
        copies = [_saved(one) for one in value]
        return copies if isinstance(value, list) else tuple(copies)
    return value


def _restored(now: Any, saved: Any) -> Any:
    """Return a copy of what was saved, of the kind that the field has now."""
    if is_dataclass(now) and not isinstance(now, type):
        return type(now)(**{name: _restored(getattr(now, name), one) for name, one in saved.items()})
    if isinstance(now, tuple) and hasattr(now, "_fields"):
        return type(now)(*saved)
    if isinstance(now, bool | float | str) and saved is not None:
        return type(now)(saved)
    return _saved(saved)


def _check(what: str, now: Any, saved: Any, is_loose: bool) -> None:
    """Refuse arrays of another shape or type, and numbers that are not finite; ValueError."""
    if isinstance(now, Mapping) and isinstance(saved, Mapping):
        for name in now.keys() & saved.keys():
            _check(f"{what}, {name!r},", now[name], saved[name], is_loose)
    elif isinstance(now, float) and saved is not None and not (is_loose or math.isfinite(float(saved))):
        raise ValueError(f"{what} is {saved}, allowed: a finite number")
    elif isinstance(now, np.ndarray):
        if not isinstance(saved, np.ndarray | np.generic) or saved.dtype != now.dtype:
            kind = getattr(saved, "dtype", type(saved).__name__)
            raise ValueError(f"{what} is of type {kind}, allowed: an array of {now.dtype}")
        if saved.shape != now.shape and not (is_loose and saved.ndim == now.ndim):
            raise ValueError(f"{what} has shape {saved.shape}, allowed: {now.shape}")
        if not (is_loose or np.isfinite(saved).all()):
            raise ValueError(f"{what} is not finite, allowed: finite numbers")


# tables whose keys are those of the moment, such as the bodies that are in a window
_PASSING = ("bodies", "boundaries", "handles")


def require_alike(where: str, saved: Any, own: Any) -> None:
    """Require that a saved state has every entry of a new one, of the same type and shape, and finite numbers where that has them.

    An entry may be None where it is None in the new state. A list has any length, and one that was empty has items of one kind. Arrays of a
    table whose lengths change together, as those of all particles do, have any length, and so has one that was empty; entries that the new
    state lacks are plain and finite. `where` names the state in messages. Raises ValueError for an entry of another type or shape or that
    is not finite, and KeyError for a missing one.
    """
    own, saved = (one[()] if isinstance(one, np.ndarray) and not one.ndim else one for one in (own, saved))
    if own is None:
        _require_plain(where, saved)
    elif _kind(saved) != _kind(own) and not (_kind(saved) == "whole number" and _kind(own) == "number"):
        raise ValueError(f"{where} is a {_kind(saved)}, allowed: a {_kind(own)}")
    elif isinstance(own, Mapping):
        for key in saved.keys() - own.keys():
            _require_plain(f"{where}/{key}", saved[key])
        for key, value in own.items():
            if key in saved or where.rpartition("/")[2] not in _PASSING:
                require_alike(f"{where}/{key}", saved[key], value)
        _require_one_length(where, {key: (own[key], saved[key]) for key in own.keys() & saved.keys()})
    elif isinstance(own, list | tuple):
        kinds = {_kind(item).removeprefix("whole ") for item in saved if item is not None}
        if isinstance(own, list) and not own and len(kinds) > 1:
            raise ValueError(f"{where} holds a {' and a '.join(sorted(kinds))}, allowed: items of one kind")
        for place, item in enumerate(saved):
            require_alike(f"{where}/{place}", item, own[min(place, len(own) - 1)] if own else None)
        _require_one_length(where, {str(place): pair for place, pair in enumerate(zip(own, saved, strict=False))})
    elif isinstance(own, np.ndarray) and (saved.dtype != own.dtype or saved.ndim != own.ndim):
        raise ValueError(f"{where} has {saved.ndim} axes of {saved.dtype}, allowed: {own.ndim} of {own.dtype}")
    elif _is_finite(own) and not _is_finite(saved):
        raise ValueError(f"{where} is not finite, allowed: finite numbers")


def _require_one_length(where: str, arrays: Mapping[str, tuple[Any, Any]]) -> None:
    """Require of the new and saved arrays of a table that those whose shape differs have one axis, the first or last, of one length.

    An array that is alone with its length keeps it, unless it was empty.
    """
    pairs = {key: (own, saved) for key, (own, saved) in arrays.items() if isinstance(own, np.ndarray) and own.ndim}
    for axis in (0, -1):
        rest = slice(1, None) if axis == 0 else slice(None, -1)
        changed = {
            (own.shape[axis], saved.shape[axis])
            for own, saved in pairs.values()
            if own.shape[axis] != saved.shape[axis]
        }
        alike = all(own.shape[rest] == saved.shape[rest] for own, saved in pairs.values())
        if alike and len(changed) <= 1:
            before, after = next(iter(changed), (0, 0))
            alike_before = [saved.shape[axis] for own, saved in pairs.values() if own.shape[axis] == before]
            if not changed or (set(alike_before) == {after} and (before == 0 or len(alike_before) > 1)):
                return
    told = ", ".join(f"{key} {saved.shape}" for key, (own, saved) in pairs.items() if own.shape != saved.shape)
    raise ValueError(f"{where} has arrays of shapes that do not fit: {told}")


def _require_plain(where: str, saved: Any) -> None:
    """Require plain values that are finite numbers, where nothing says what they should be."""
    if isinstance(saved, Mapping):
        for key, value in saved.items():
            _require_plain(f"{where}/{key}", value)
    elif isinstance(saved, list | tuple):
        for place, value in enumerate(saved):
            _require_plain(f"{where}/{place}", value)
    elif np.iscomplexobj(saved):
        raise ValueError(f"{where} is complex, allowed: real numbers")
    elif not _is_finite(saved):
        raise ValueError(f"{where} is not finite, allowed: finite numbers")


def _is_finite(value: Any) -> bool:
    """Tell whether a number or all numbers of an array are finite; other values have none."""
    is_real = isinstance(value, float | np.ndarray | np.generic) and np.asarray(value).dtype.kind in "fc"
    return bool(np.isfinite(value).all()) if is_real else True


def _kind(value: Any) -> str:
    """Return the kind of a plain value, in words."""
    kinds: tuple[tuple[str, Any], ...] = (
        ("truth value", (bool, np.bool_)),
        ("whole number", (int, np.integer)),
        ("number", (float, np.floating)),
        ("text", str),
        ("list", (list, tuple)),
        ("table", Mapping),
        ("array", np.ndarray),
    )
    return next((name for name, types in kinds if isinstance(value, types)), type(value).__name__)
