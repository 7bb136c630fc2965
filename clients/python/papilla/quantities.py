"""Units of the quantities of a series, and what each is."""

from __future__ import annotations

from typing import Final, NamedTuple


class Quantity(NamedTuple):
    """Unit of a quantity, and what it is."""

    unit: str
    about: str


QUANTITIES: Final[dict[str, Quantity]] = {
    "sed_j_per_m3": Quantity("J m-3", "strain energy density at the dermis-epidermis interface"),
    "rates_hz": Quantity("s-1", "firing rate of SA1 afferents"),
    "pressure_pa": Quantity("Pa", "pressure on the skin that was found"),
    "displacement_mm": Quantity("mm", "how far the skin has moved, in the finger's frame"),
    "shear_pa": Quantity("Pa", "traction along the skin, in the finger's frame"),
    "points_j_per_m3": Quantity("J m-3", "strain energy density at the points of the hello"),
    "point_rates_hz": Quantity("s-1", "firing rate of SA1 afferents at the points of the hello"),
    "actuators": Quantity("1", "intensity of each actuator"),
    "sensor_pressure_pa": Quantity("Pa", "pressure on the skin that reproduces the sensor's readings"),
    "sensor_reproduction": Quantity("1", "norm of readings minus their reproduction, over that of the readings"),
    "error_sed_median": Quantity("1", "half of such maps of SED are less wrong, relative L2 to finite elements"),
    "error_sed_p90": Quantity("1", "nine of ten such maps of SED are less wrong, relative L2 to finite elements"),
    "error_force_median": Quantity("1", "half of such forces are less wrong, relative to finite elements"),
    "error_force_p90": Quantity("1", "nine of ten such forces are less wrong, relative to finite elements"),
    "total_us": Quantity("us", "time in the service"),
    "queue_us": Quantity("us", "time in the service spent waiting for a thread"),
    "infer_us": Quantity("us", "time in the network"),
}
"""Quantities of a series, but for those of `touch_` and `summary_`."""
_ENDS: Final = {
    "_n": "N", "_n_mm": "N mm", "_mm2": "mm2", "_mm": "mm", "_n_per_mm": "N mm-1", "_pa": "Pa", "_us": "us",
    "_px": "pixel", "_px2": "pixel2", "_j_per_m3": "J m-3", "_uj_per_m": "uJ m-1", "_hz": "s-1", "share": "1",
}  # fmt: skip


def quantity(name: str) -> Quantity:
    """Unit and meaning of a variable."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    of_network = name.removeprefix("network_")
    if of_network in QUANTITIES:
        unit, about = QUANTITIES[of_network]
        return Quantity(unit, f"{about}; of the network alone, as if the map of pressure were exact")
    end = max((end for end in _ENDS if name.endswith(end)), key=len)
    source, _, rest = name.partition("_")
    return Quantity(_ENDS[end], f"{rest} of the section {source} of the answer")
