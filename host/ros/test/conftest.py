"""A DDS domain for each test: a peer of another test, which may still be there, is not heard."""

import itertools

import pytest

domains = itertools.count(1)


@pytest.fixture(autouse=True)
def domain(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(next(domains)))
