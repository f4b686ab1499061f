"""palpate-ros beside Cyclone DDS."""

import random

from messages import NAN, Touch, Verdict
from peer import Node, Peer, qos, take

import os

MODEL = os.environ["PALPATE_MODEL"]


def draw(count, seed):
    """Touches in which one finger in five is missing; no object touches like this."""
    rng = random.Random(seed)
    time = lambda: NAN if rng.random() < 0.2 else rng.uniform(0, 0.3)
    return [Touch([time(), time(), time()]) for _ in range(count)]


def test_a_touch_gets_a_verdict():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.reader("verdict", Verdict), peer.writer("touch", Touch)
        touches.write(Touch([0.03, 0.0, 0.05]))
        [verdict] = take(verdicts, 1)
        assert verdict.touch == 1 and verdict.verdict == "undecided" and verdict.refused == ""
        assert len(verdict.objects) == len(verdict.posteriors) == 10
        assert abs(sum(verdict.posteriors) - 1) < 1e-9 and verdict.posterior == max(verdict.posteriors)
        assert verdict.objects[verdict.posteriors.index(verdict.posterior)] == verdict.object
        assert node.stop() == 0


def test_ten_thousand_touches_get_a_verdict_each():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.reader("verdict", Verdict), peer.writer("touch", Touch)
        taken = []
        for number, touch in enumerate(draw(10_000, seed=1)):
            touches.write(touch)
            # As many under way as a publisher keeps.
            while number - len(taken) > 500:
                taken += take(verdicts, 1)
        taken += take(verdicts, 10_000 - len(taken))
        counted = 0
        for verdict in taken:
            counted = counted if verdict.refused else counted + 1
            assert verdict.touch == counted, verdict
            if verdict.verdict != "undecided":
                counted = 0
