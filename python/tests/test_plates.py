"""Plates on a measuring machine that `examples/warm_plates.py` makes, by none of the product's formulas."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import numpy as np
import pytest
from conftest import ROOT

import errsep


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("warm_plates", ROOT / "examples/warm_plates.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_temperatures_of_plates_are_named_and_told(maker: ModuleType) -> None:
    generator = np.random.default_rng(5)
    kelvins = [0.8, -0.3, 0.1, 1.9]
    tables = [maker.plate(warm, generator) for warm in kelvins]
    answer = errsep.diagnose(tables, maker.MACHINE, severity=0)
    assert answer["verdict"]["effects"] == ["part-temperature"], answer.summary()
    sizes = answer.quantities
    for part, warm in enumerate(kelvins, 1):
        size = sizes[maker.SIZE.format(part)]
        # k·u with k = 4.
        assert abs(size.value - maker.EXPANSION * warm) < 4 * size.std, size
        assert size.std < 1e-6
    spread = sizes["candidates.part-temperature.parameters.scale-of-parts"]
    root = np.sqrt(np.mean(np.square(kelvins))) * maker.EXPANSION
    assert abs(spread.value - root) < 4 * spread.std
    withheld = errsep.diagnose(tables, maker.MACHINE, severity=0, without="part-temperature")
    assert withheld["verdict"]["kind"] == "unknown"


def test_plates_of_one_temperature_have_one_scale(maker: ModuleType) -> None:
    generator = np.random.default_rng(6)
    tables = [maker.plate(1.2, generator) for _ in range(3)]
    answer = errsep.diagnose(tables, maker.MACHINE, severity=0)
    assert answer["verdict"]["effects"] == ["thermal-expansion"], answer.summary()
