"""Capability maps on disk: netCDF for finished ones, and what a search that was interrupted goes on from."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jffsr.errors import InputError
from jffsr.writing import write_atomically

if TYPE_CHECKING:
    from jffsr.capture.capability_map import CapabilityMap

_FORMAT = 1
_KIND = "jffsr capability map"


def save_part(path: Path, mark: str, reached: np.ndarray) -> None:
    """Write what is searched so far, (cells, attitudes), atomically, under the mark of its map."""
    head = json.dumps({"format": _FORMAT, "mark": mark, "attitudes": reached.shape[1]}).encode()

    def write(part: Path) -> None:
        with open(part, "wb") as file:
            np.savez(file, head=np.frombuffer(head, dtype=np.uint8), reached=np.packbits(reached, axis=1))

    try:
        write_atomically(path, write)
    except OSError as error:
        raise InputError(f"{path}: the checkpoint cannot be written ({error.strerror or error})") from None


def load_part(path: Path, mark: str, attitudes: int) -> np.ndarray:
    """What was searched, (cells, attitudes), nothing where there is no file; InputError for another map's file."""
    if not path.exists():
        return np.zeros((0, attitudes), dtype=bool)
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
            head = json.loads(file["head"].tobytes())
            packed = file["reached"]
    except Exception as error:
        raise InputError(
            f"{path}: the checkpoint cannot be read ({error}); delete it to start again"
        ) from None
    if head.get("format") != _FORMAT or head.get("mark") != mark:
        raise InputError(f"{path}: the checkpoint is of another map; give another file or delete it")
    return np.unpackbits(packed, axis=1, count=attitudes).astype(bool)


def save_capability_map(capability: CapabilityMap, path: str | os.PathLike[str]) -> None:
    """Write a map as netCDF-4, labelled and with units, whole or not at all.

    Raises InputError where the file cannot be written.
    """
    import xarray

    rolls = capability.rolls
    x, y, z = capability.axes
    reached = np.rint(np.asarray(capability.direction_share) * rolls).astype(np.int16)
    count = {"units": "1", "long_name": f"rolls out of {rolls} that are reached"}
    towards = {"units": "1", "long_name": "tool's x axis in the base frame"}
    share = {"units": "1", "long_name": "share of the poses in the cell's centre that are reached"}
    dataset = xarray.Dataset(
        {
            "share": (("x", "y", "z"), np.asarray(capability.share), share),
            "rolls_reached": (("x", "y", "z", "direction"), reached, count),
            "direction_vector": (("direction", "axis"), np.asarray(capability.direction), towards),
        },
        coords={
            name: (name, values, {"units": "m", "long_name": f"{name} in the base frame"})
            for name, values in (("x", x), ("y", y), ("z", z))
        }
        | {"axis": ("axis", ["x", "y", "z"])},
        attrs={
            "kind": _KIND,
            "format": _FORMAT,
            "robot": capability.robot,
            "end_effector": capability.end_effector,
            "rolls": rolls,
            "self_clearance": int(capability.self_clearance),
            "spacing": float(capability.spacing),
        },
    )
    # HDF5 may end the process where the disk is full, so it writes to memory first.
    buffer = io.BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding={"rolls_reached": {"zlib": True, "complevel": 4}})
    path = Path(path)
    try:
        write_atomically(path, lambda part: part.write_bytes(buffer.getbuffer()))
    except OSError as error:
        raise InputError(f"{path}: the map cannot be written ({error.strerror or error})") from None


def load_capability_map(path: str | os.PathLike[str]) -> CapabilityMap:
    """Read a map; InputError where the file is missing, damaged, or no map whose numbers agree with each other."""
    import xarray

    from jffsr.capture.capability_map import CapabilityMap

    path = Path(path)
    try:
        with xarray.open_dataset(path, engine="h5netcdf") as opened:
            dataset = opened.load()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; a capability map in netCDF is expected") from None
    except Exception as error:
        raise InputError(f"{path}: the capability map cannot be read ({error})") from None
    attrs = dataset.attrs
    if attrs.get("kind") != _KIND or attrs.get("format") != _FORMAT:
        raise InputError(f"{path}: this is no capability map of this version of jffsr")
    try:
        rolls, spacing = int(attrs["rolls"]), float(attrs["spacing"])
        direction_share = dataset["rolls_reached"].values / rolls
        share = dataset["share"].values
        origin = np.array([float(dataset[name].values[0]) for name in "xyz"])
        found = CapabilityMap(
            origin=origin,
            spacing=np.asarray(spacing),
            share=share,
            direction_share=direction_share,
            direction=dataset["direction_vector"].values,
            robot=str(attrs["robot"]),
            end_effector=str(attrs["end_effector"]),
            rolls=rolls,
            self_clearance=bool(attrs["self_clearance"]),
        )
    except KeyError as error:
        raise InputError(f"{path}: the capability map lacks {error}") from None
    whole = np.abs(direction_share.mean(axis=-1) - share).max() < 1e-12
    spaced = all(np.allclose(np.diff(dataset[name].values), spacing) for name in "xyz")
    unit = np.allclose(np.linalg.norm(found.direction, axis=1), 1.0)
    if not (whole and spaced and unit and np.all((share >= 0) & (share <= 1))):
        raise InputError(f"{path}: the capability map is damaged: its numbers do not agree with each other")
    return found
