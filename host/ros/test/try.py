"""Touches something flat until the node says what it is. ROS_DOMAIN_ID is that of the node."""

import os
import random

os.environ.setdefault("ROS_DOMAIN_ID", "0")

from messages import NAN, String, Touch
from peer import Peer, qos, take


class Node:
    """The node that is running."""

    base = "/palpate"


peer = Peer(Node)
texts = peer.reader("verdict_text", String, qos=qos(latched=True))
touches = peer.writer("touch", Touch)
print(take(texts, 1)[0].data)
rng = random.Random(1)
while True:
    touches.write(Touch([rng.uniform(0, 0.002), rng.uniform(0, 0.002), rng.choice([0.001, 0.002, NAN])]))
    [text] = take(texts, 1)
    print(text.data)
    if not text.data.startswith("undecided"):
        break
