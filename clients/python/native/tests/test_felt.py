"""Rates, spikes and actuators of SED that is known: the bits of a session that found the same SED."""

import numpy as np
import pytest

import papilla
from papilla import actuators, afferents

TIMES_S = 1.0 + 0.01 * np.arange(6)
PINS = {
    "input": "sed", "drive": "formula", "radius_mm": 1.0, "gain": 0.002, "threshold": 50, "max": 1,
    "actuators": [{"at": {"px": [112, 90]}}, {"at": {"px": [118, 105]}}],
}  # fmt: skip


@pytest.fixture(scope="module")
def felt():
    """Answers of a session in process to a press that comes and goes, with all that is felt of it."""
    pressure_pa = np.zeros((224, 224), np.float32)
    pressure_pa[95:115, 105:130] = 8e3
    frames = [pressure_pa * share for share in (0.0, 0.3, 1.0, 1.2, 1.2, 0.2)]
    hello = {"effects": ["afferents", "spikes", "actuators", "summary"], "actuators": PINS}
    with papilla.local(tier="nano", **hello) as session:
        answers = [
            session.render(frame, client_time_us=round(1e6 * time)) for frame, time in zip(frames, TIMES_S, strict=True)
        ]
        return np.stack(frames), np.stack([one.sed for one in answers]), answers, session.ready


def test_rates_are_those_of_a_session_to_the_bit(felt):
    _, sed, answers, _ = felt
    rates_hz = afferents.rates(sed, TIMES_S)
    assert rates_hz.shape == (6, 224, 224) and rates_hz[3].max() > 1.0
    assert rates_hz.tobytes() == np.stack([one.rates_hz for one in answers]).tobytes()
    # The dynamic part goes by time.
    assert not np.array_equal(afferents.rates(sed, 10 * TIMES_S)[2], rates_hz[2])


def test_spikes_are_those_of_a_session_to_the_bit(felt):
    pressure_pa, sed, answers, ready = felt
    trains, there = afferents.spikes(sed, TIMES_S, pressure_pa), papilla.SpikeTrains(ready)
    for one in answers:
        there.add(one)
    assert len(trains.unit) > 10 and trains.lost == there.lost
    assert np.array_equal(trains.unit, there.unit) and np.array_equal(trains.time_us, there.time_us)
    assert np.array_equal(trains.classes, there.classes) and np.array_equal(trains.px, there.px)
    # PC units go by force; the others do not know of it.
    assert (trains.classes[trains.unit] == "pc").any()
    without = afferents.spikes(sed, TIMES_S)
    assert not (without.classes[without.unit] == "pc").any()
    others = trains.classes[trains.unit] != "pc"
    assert np.array_equal(without.unit, trains.unit[others])


def test_actuators_are_those_of_a_session_to_the_bit(felt):
    _, sed, answers, _ = felt
    found = actuators.intensities(sed, layout=PINS)
    assert found.tobytes() == np.stack([one.actuators for one in answers]).tobytes() and found.max() > 0
    assert np.array_equal(actuators.intensities(sed[3], layout=PINS), found[3])
    by_rate = PINS | {"input": "sa1_rate", "gain": 0.01, "threshold": 0}
    felt_rate = actuators.intensities(sed, TIMES_S, layout=by_rate, effects=["afferents"])
    assert felt_rate.shape == (6, 2) and felt_rate.max() > 0


def test_a_feel_goes_on_and_can_be_reset(felt):
    pressure_pa, sed, answers, _ = felt
    feel = afferents.Feel(effects=["afferents", "summary"])
    first = feel.series(sed, TIMES_S, pressure_pa)
    assert [one.summary for one in first] == [one.summary for one in answers]
    # One frame later the same map has a rate that goes by the frames before.
    later = feel.step(sed[3], float(TIMES_S[-1]) + 0.01)
    feel.reset()
    assert not np.array_equal(feel.step(sed[3], float(TIMES_S[-1]) + 0.01).rates_hz, later.rates_hz)
    feel.reset()
    again = [feel.step(one, float(time)) for one, time in zip(sed, TIMES_S, strict=True)]
    assert [one.rates_hz.tobytes() for one in again] == [one.rates_hz.tobytes() for one in first]


def test_what_cannot_be_felt_is_said(felt, tmp_path):
    _, sed, _, _ = felt
    for effects, words in [(["relaxation"], "a session has it"), (["spikez"], "spikez"), ([], "none is named")]:
        with pytest.raises(papilla.Refused, match=words):
            afferents.Feel(effects=effects)
    with pytest.raises(papilla.Refused, match="network"):
        actuators.intensities(sed, layout=PINS | {"drive": "corrected"})
    with pytest.raises(papilla.BadInput, match="have to rise"):
        afferents.rates(sed, TIMES_S[::-1])
    with pytest.raises(papilla.BadInput, match="is due"):
        afferents.rates(sed[0], TIMES_S)
    bad = sed.copy()
    bad[2, 3, 4] = np.nan
    with pytest.raises(papilla.BadInput, match=r"sed_j_per_m3: nan at \[3, 4\]"):
        afferents.Feel(effects=["afferents"]).step(bad[2])
    with pytest.raises(papilla.BadInput, match=r"sed_j_per_m3, frame 2: nan at \[3, 4\]"):
        afferents.rates(bad, TIMES_S)
    feel = afferents.Feel(effects=["afferents"])
    feel.series(sed[:4], 10.0 * np.arange(4))
    assert any("were ms" in words for words in feel.warnings)
    with pytest.raises(papilla.BadModels, match=r"atlas\.json"):
        afferents.rates(sed, TIMES_S, bundle=tmp_path)
