"""Shared by several tests: small data sets and models."""

from __future__ import annotations

import os

# Before the libraries are loaded: their threads spin where others want the cores too.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import palpate
import pytest

OBJECTS = ["bowl", "fork", "mouse"]


@pytest.fixture(scope="session")
def touches() -> palpate.DataSet:
    return palpate.capture(OBJECTS, touches=1500)


@pytest.fixture(scope="session")
def unseen() -> palpate.DataSet:
    return palpate.capture(OBJECTS, touches=600, seed=2)


@pytest.fixture(scope="session")
def ensemble(touches: palpate.DataSet) -> palpate.Ensemble:
    return palpate.train(touches, rounds=15)


@pytest.fixture(scope="session")
def model(ensemble: palpate.Ensemble) -> palpate.Model:
    return palpate.compile(ensemble)
