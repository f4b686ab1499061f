"""palpate-ros beside Cyclone DDS."""

import math
import os
import random
import signal
import socket
import subprocess
import sys
import time
import uuid

import pytest
from cyclonedds.pub import DataWriter
from messages import *
from peer import Node, Peer, Service, qos, take, until

MODEL = os.environ["PALPATE_MODEL"]
# A bowl's, nearly.
LEVEL = [0.0, 0.0, 0.0]
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


def draw(count, seed):
    """Touches in which one finger in five is missing; no object touches like this."""
    rng = random.Random(seed)
    time = lambda: NAN if rng.random() < 0.2 else rng.uniform(0, 0.3)
    return [Touch([time(), time(), time()]) for _ in range(count)]


def exchange(touches, verdicts, drawn):
    """Verdicts on touches, at most as many under way at a time as a publisher keeps."""
    taken = []
    for number, touch in enumerate(drawn):
        touches.write(touch)
        while number - len(taken) > 500:
            taken += take(verdicts, 1)
    return taken + take(verdicts, len(drawn) - len(taken))


def said(verdict):
    return verdict.touch, verdict.verdict, verdict.object, verdict.posteriors, verdict.refused


@pytest.mark.parametrize(
    "arguments, code, why",
    [
        ([], 2, "MODEL"),
        ([MODEL, "--error-rate", "0.7"], 2, "below 0.5"),
        ([MODEL, "--max-touches", "-1"], 2, "-1"),
        ([MODEL, "--name", "9"], 2, "9"),
        ([MODEL, "--domain", "300"], 2, "300"),
        (["--port", "http://there"], 2, "not a port"),
        (["none.palpate"], 1, "none.palpate: cannot read the model"),
        ([__file__], 1, "test_node.py: byte 0"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_reason(arguments, code, why):
    ended = subprocess.run([os.environ["PALPATE_ROS"], *arguments], capture_output=True, text=True, timeout=30)
    assert (ended.returncode, ended.stdout) == (code, "") and why in ended.stderr, ended


def test_a_touch_gets_a_verdict_and_evidence():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, evidence = peer.latched("verdict", Verdict), peer.latched("evidence", Evidence)
        touches = peer.writer("touch", Touch)
        touches.write(Touch([0.03, 0.0, 0.05]))
        [verdict], [evidence] = take(verdicts, 1), take(evidence, 1)
        assert verdict.touch == 1 and verdict.verdict == "undecided" and verdict.refused == ""
        assert len(verdict.objects) == len(verdict.posteriors) == 10
        assert abs(sum(verdict.posteriors) - 1) < 1e-9 and verdict.posterior == max(verdict.posteriors)
        best = verdict.posteriors.index(verdict.posterior)
        assert verdict.objects[best] == verdict.object
        assert evidence.nats[best] == 0 == max(evidence.nats) and evidence.objects == verdict.objects
        assert node.stop() == 0
        until(lambda: not touches.get_matched_subscriptions(), "the node did not say goodbye")


def test_ten_thousand_touches_get_a_verdict_each():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        began, counted = time.monotonic(), 0
        for verdict in exchange(touches, verdicts, draw(10_000, seed=1)):
            counted = counted if verdict.refused else counted + 1
            assert verdict.touch == counted, verdict
            if verdict.verdict != "undecided":
                counted = 0
        print(f"10,000 touches in {time.monotonic() - began:.1f} s")


def test_missing_contacts_count_and_numbers_that_are_no_times_are_refused():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        times = [[0.0, 0.1, NAN], [NAN, NAN, 5.0], [NAN, NAN, NAN], [-1.0, 0.0, 0.0], [float("inf"), 0.0, 0.0]]
        said = exchange(touches, verdicts, [Touch(three) for three in times])
        assert [verdict.touch for verdict in said] == [1, 2, 2, 2, 2]
        assert [bool(verdict.refused) for verdict in said] == [False, False, True, True, True]
        assert "no finger touched" in said[2].refused and "the time -1 is negative" in said[3].refused


def test_a_message_of_another_layout_is_reported_and_the_node_goes_on():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        diagnostics = peer.reader("/diagnostics", DiagnosticArray)
        # Such as an older definition of the message. What is written before the node has found its publisher is lost.
        others = peer.writer("touch", OtherTouch)
        count = lambda: [v.value for a in take(diagnostics, 1) for v in a.status[0].values if "cannot be read" in v.key]
        until(lambda: others.write(OtherTouch(0.1)) or count()[0] != "0", "the message is not reported")
        touches.write(Touch(LEVEL))
        assert take(verdicts, 1)[0].touch == 1


def test_diagnostics_say_what_happened():
    with Node(MODEL) as node:
        peer = Peer(node)
        diagnostics, touches = peer.reader("/diagnostics", DiagnosticArray), peer.writer("touch", Touch)
        touches.write(Touch(LEVEL))
        touches.write(Touch([NAN, NAN, NAN]))

        def values():
            [status] = take(diagnostics, 1)[0].status
            assert status.name == "palpate: recognition" and status.level in (0, 1)
            return {value.key: value.value for value in status.values}

        until(lambda: (values()["touches"], values()["not counted"]) == ("2", "1"), "the touches are not reported")


def test_touches_that_were_lost_are_counted():
    with Node(MODEL) as node:
        peer = Peer(node)
        diagnostics, touches = peer.reader("/diagnostics", DiagnosticArray), peer.writer("touch", Touch, qos=qos(depth=10))
        verdicts = peer.latched("verdict", Verdict)
        touches.write(Touch(LEVEL))
        take(verdicts, 1)
        # More than the publisher keeps for a node that is slower.
        for _ in range(2_000):
            touches.write(Touch(LEVEL))

        def all_counted():
            values = {value.key: int(value.value) for value in take(diagnostics, 1)[0].status[0].values[1:6]}
            return values["touches"] + values["lost on the way"] == 2_001

        until(all_counted, "touches are missing without a word")


def test_a_late_subscriber_gets_the_last_verdict():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        last = exchange(touches, verdicts, draw(3, seed=2))[-1]
        late = Peer(node).reader("verdict", Verdict, qos=qos(latched=True, depth=1))
        assert said(take(late, 1)[0]) == said(last)
        assert len(Peer(node).reader("verdict", Verdict).take()) == 0


@pytest.mark.parametrize("port", [10, 11], ids=["discovery", "data"])
def test_a_node_of_whose_ports_another_process_has_one_is_heard_and_hears(port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        # The port of participant 0, by the RTPS specification.
        taken.bind(("0.0.0.0", 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"]) + port))
        with Node(MODEL) as node:
            peer = Peer(node)
            verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
            touches.write(Touch(LEVEL))
            assert take(verdicts, 1)[0].touch == 1


def test_a_node_that_was_killed_is_found_again_when_it_starts():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        touches.write(Touch(LEVEL))
        assert take(verdicts, 1)[0].touch == 1
        assert node.stop(signal.SIGKILL) == -signal.SIGKILL
        with Node(MODEL):
            # The same participant beside it, which still believes in the one that is gone.
            until(lambda: len(touches.get_matched_subscriptions()) == 2, "the new node is not found")
            until(lambda: len(verdicts.get_matched_publications()) == 2, "the new node is not found")
            assert take(verdicts, 1)[0].touch == 0
            touches.write(Touch(LEVEL))
            assert take(verdicts, 1)[0].touch == 1


def test_a_subscriber_that_no_longer_answers_does_not_stop_the_node():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        stopped = subprocess.Popen([sys.executable, "-c", STOPS, node.base])
        until(lambda: stopped.poll() is not None or is_stopped(stopped.pid), "the subscriber does not stop")
        try:
            assert stopped.poll() is None
            assert [v.touch for v in exchange(touches, verdicts, draw(30, seed=6))][-1] > 0
        finally:
            stopped.kill()
            stopped.wait()


# A subscriber that has got a verdict and then reads nothing more.
STOPS = """
import os, signal, sys, types
from messages import Verdict
from peer import Peer
reader = Peer(types.SimpleNamespace(base=sys.argv[1])).latched("verdict", Verdict)
os.kill(os.getpid(), signal.SIGSTOP)
"""


def is_stopped(pid):
    with open(f"/proc/{pid}/stat") as stat:
        return stat.read().rsplit(")", 1)[1].split()[0] == "T"


def test_a_node_that_was_stopped_and_continues_ends_with_the_reason():
    with Node(MODEL) as node:
        Peer(node).latched("verdict", Verdict)
        node.process.send_signal(signal.SIGSTOP)
        until(lambda: is_stopped(node.process.pid), "the node does not stop")
        node.process.send_signal(signal.SIGCONT)
        assert node.process.wait(30) == 1
        assert "start it again" in node.process.stderr.read()


def test_two_nodes_say_the_same_of_the_same_touches():
    drawn = draw(200, seed=3)
    with Node(MODEL, namespace="/left") as left, Node(MODEL, namespace="/right") as right:
        of = [(peer.writer("touch", Touch), peer.latched("verdict", Verdict)) for peer in (Peer(left), Peer(right))]
        one, other = [[said(v) for v in exchange(touches, verdicts, drawn)] for touches, verdicts in of]
        assert one == other and len(one) == 200


def test_a_best_effort_publisher_is_heard_if_the_node_says_so():
    with Node(MODEL, "--best-effort") as node:
        peer = Peer(node)
        verdicts = peer.latched("verdict", Verdict)
        for reliable in (False, True):
            touches = peer.writer("touch", Touch, qos=qos(reliable))
            # Lost samples are not sent again.
            until(lambda: touches.write(Touch(LEVEL)) or verdicts.take(), "no verdict")


def test_a_best_effort_publisher_is_not_heard_otherwise():
    with Node(MODEL) as node:
        peer = Peer(node)
        peer.writer("touch", Touch)
        unheard = DataWriter(peer.participant, peer.topic("touch", Touch), qos=qos(reliable=False))
        time.sleep(1)
        assert not unheard.get_matched_subscriptions()


def test_a_verdict_is_also_a_line_of_text():
    with Node(MODEL) as node:
        peer = Peer(node)
        peer.latched("verdict", Verdict)
        texts, touches = peer.reader("verdict_text", String, qos=qos(latched=True)), peer.writer("touch", Touch)
        assert take(texts, 1)[0].data == "undecided after 0 touches"
        touches.write(Touch(LEVEL))
        touches.write(Touch([NAN, NAN, NAN]))
        counted, refused = [text.data for text in take(texts, 2)]
        assert counted.startswith("undecided after 1 touch, most likely ")
        assert "; not counted: no finger touched" in refused


def test_a_reset_forgets_and_sets_priors():
    with Node(MODEL) as node:
        peer = Peer(node)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        reset = Service(peer, "reset", ResetRequest, ResetResponse)
        touches.write(Touch(LEVEL))
        assert take(verdicts, 1)[0].touch == 1
        answer = reset.call(ResetRequest(["bowl", "fork"], [1, 1]))
        assert answer.success and answer.message == ""
        [verdict] = take(verdicts, 1)
        assert verdict.touch == 0 and sorted(verdict.posteriors)[-3:] == [0, 0.5, 0.5]
        answer = reset.call(ResetRequest(["cup"]))
        assert not answer.success and 'no object "cup"' in answer.message
        touches.write(Touch(LEVEL))
        [verdict] = take(verdicts, 1)
        assert verdict.touch == 1 and verdict.object in ("bowl", "fork")


def test_a_reset_over_cyclone_says_which_request_it_answers():
    with Node(MODEL, "--middleware", "cyclonedds") as node:
        reset = Service(Peer(node), "reset", NumberedResetRequest, NumberedResetResponse)
        for number in (1, 2):

            def answers():
                # Again: on a busy machine the reader may be found later than the second that the node waits for it.
                reset.ask(NumberedResetRequest(RequestHeader(77, number)))
                time.sleep(0.2)
                return [answer for answer in reset.responses.take(100) if answer.header.number == number]

            for answer in until(answers, "no response"):
                assert answer.success and answer.header.client == 77


def test_a_request_that_comes_before_the_reader_of_its_response_is_found_gets_a_response():
    with Node(MODEL) as node:
        for _ in range(2):
            reset = Service(Peer(node), "reset", ResetRequest, ResetResponse, late=True)
            reset.ask_before_responses_can_be_heard(ResetRequest())
            assert reset.answer().success
        send = Service(Peer(node), "recognize/_action/send_goal", SendGoalRequest, SendGoalResponse, late=True)
        send.ask_before_responses_can_be_heard(SendGoalRequest(GoalId(uuid.uuid4().bytes), Goal()))
        assert send.answer().accepted


def test_a_client_that_never_hears_responses_does_not_keep_the_node_from_others():
    with Node(MODEL, "--middleware", "cyclonedds") as node:
        deaf, other = (
            Service(Peer(node), "reset", NumberedResetRequest, NumberedResetResponse, late=late) for late in (True, False)
        )
        for number in range(100):
            deaf.ask(NumberedResetRequest(RequestHeader(1, number)))

        def other_is_answered():
            other.ask(NumberedResetRequest(RequestHeader(2, 1)))
            time.sleep(0.1)
            # Responses to the deaf are heard, too, and the node keeps the last ten only.
            return any(answer.header.client == 2 for answer in other.responses.take(1000))

        # The node waits for a second, not for a hundred.
        until(other_is_answered, "no response")


def test_parameters_change_the_model_and_the_thresholds(tmp_path):
    with Node(MODEL) as node:
        peer = Peer(node)
        parameters = Service(peer, "set_parameters", SetParametersRequest, SetParametersResponse)
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)

        def set(name, value):
            return parameters.call(SetParametersRequest([Parameter(name, value)])).results[0]

        assert set("max_touches", ParameterValue(2, integer_value=2)).successful
        assert set("error_rate", ParameterValue(3, double_value=1e-12)).successful
        take(verdicts, 2)
        assert [v.verdict for v in exchange(touches, verdicts, [Touch(LEVEL)] * 2)] == ["undecided", "gave-up"]
        for name, value, why in [
            ("error_rate", ParameterValue(3, double_value=0.7), "below 0.5"),
            ("max_touches", ParameterValue(2, integer_value=-1), "max_touches"),
            ("max_touches", ParameterValue(4, string_value="2"), "type"),
            ("model", ParameterValue(4, string_value=str(tmp_path / "none.palpate")), "cannot read the model"),
            ("speed", ParameterValue(3, double_value=1.0), "undeclared"),
        ]:
            result = set(name, value)
            assert not result.successful and why in result.reason, result
        cut = tmp_path / "cut.palpate"
        cut.write_bytes(open(MODEL, "rb").read()[:1000])
        result = set("model", ParameterValue(4, string_value=str(cut)))
        assert not result.successful and "cut.palpate" in result.reason
        copy = tmp_path / "copy.palpate"
        copy.write_bytes(open(MODEL, "rb").read())
        assert set("model", ParameterValue(4, string_value=str(copy))).successful
        assert take(verdicts, 1)[0].touch == 0


@pytest.fixture
def maps(tmp_path):
    """A model of maps of a bar and a puck."""
    path = tmp_path / "maps.palpate"
    subprocess.run([os.environ["PALPATE_MAPS"], path], check=True)
    return path


def press(place, yaw, at):
    """The touch of a hand that comes down at a pose on the bar."""
    roll = 2 * math.atan2(at.orientation.z, at.orientation.w)
    heights = []
    for along in (-0.015, 0, 0.015):
        x, y = at.position.x + along * math.cos(roll) - place[0], at.position.y + along * math.sin(roll) - place[1]
        u, v = math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x
        heights.append(0.025 if abs(u) <= 0.02 and abs(v) <= 0.008 else 0.0)
    first = max(heights)
    times = [NAN if first - height > 0.02 else (first - height) / 0.1 for height in heights]
    down, row = [0.0, 0.0, -1.0], [math.cos(roll), math.sin(roll), 0.0]
    return Touch(times, True, down, row, "", True, [at.position.x, at.position.y, first])


def test_a_hand_that_knows_where_it_is_learns_what_lies_where(maps):
    place, yaw = (0.012, -0.007), math.pi / 6
    with Node(maps, "--frame-id", "tray") as node:
        peer, last = Peer(node), qos(latched=True)
        parameters = Service(peer, "set_parameters", SetParametersRequest, SetParametersResponse)
        verdicts, next_poses = peer.latched("verdict", Verdict), peer.reader("next_pose", PoseStamped, qos=last)
        poses, placements = peer.reader("pose", PoseWithCovarianceStamped), peer.reader("placement", String)
        touches = peer.writer("touch", Touch)
        [middle] = take(next_poses, 1)
        assert (middle.header.frame_id, middle.pose.position) == ("tray", Point(0, 0, 0))
        touches.write(Touch(LEVEL))
        assert "no position" in take(verdicts, 1)[0].refused
        [there], verdict = take(next_poses, 1), None
        while verdict is None or verdict.verdict == "undecided":
            there = there if verdict is None else take(next_poses, 1)[0]
            touches.write(press(place, yaw, there.pose))
            [verdict] = take(verdicts, 1)
        assert (verdict.verdict, verdict.object, verdict.refused) == ("recognized", "bar", "")
        pose = take(poses, verdict.touch)[-1]
        assert pose.header.frame_id == "tray" and {line.data for line in take(placements, verdict.touch)} == {"flat"}
        at, covariance = pose.pose.pose.position, pose.pose.covariance
        assert abs(at.x - place[0]) < 3 * covariance[0] ** 0.5 < 0.015
        assert abs(at.y - place[1]) < 3 * covariance[7] ** 0.5 < 0.015
        assert [index for index, number in enumerate(covariance) if number] == [0, 7, 35]
        for frame in ("", "table"):
            value = ParameterValue(4, string_value=frame)
            [result] = parameters.call(SetParametersRequest([Parameter("frame_id", value)])).results
            assert result.successful == bool(frame)
        touches.write(press(place, yaw, middle.pose))
        assert take(verdicts, 1)[0].touch == 1 and take(poses, 1)[0].header.frame_id == "table"


def test_a_model_of_maps_is_not_for_a_chip(maps, chip):
    ended = subprocess.run(
        [os.environ["PALPATE_ROS"], maps, "--port", chip.address], capture_output=True, text=True, timeout=30
    )
    assert ended.returncode == 1 and "a chip does not load a model of maps" in ended.stderr


class Client:
    """A client of the action."""

    def __init__(self, peer):
        name = "recognize/_action"
        self.feedback = peer.reader(f"{name}/feedback", Feedback)
        self.send = Service(peer, f"{name}/send_goal", SendGoalRequest, SendGoalResponse)
        self.result = Service(peer, f"{name}/get_result", GetResultRequest, GetResultResponse)
        self.cancel = Service(peer, f"{name}/cancel_goal", CancelRequest, CancelResponse)

    def begin(self, goal=None):
        """Sends a goal, and asks for its result if it is accepted."""
        goal_id = GoalId(uuid.uuid4().bytes)
        if not self.send.call(SendGoalRequest(goal_id, goal or Goal())).accepted:
            return None
        self.result.ask(GetResultRequest(goal_id))
        return goal_id


def test_a_goal_gets_feedback_for_each_touch_and_a_result():
    with Node(MODEL) as node:
        peer = Peer(node)
        client, touches = Client(peer), peer.writer("touch", Touch)
        for _ in range(3):
            goal = client.begin(Goal(["bowl", "fork"], [9, 1]))
            assert client.begin() is None, "a second goal at a time is accepted"
            touches.write(Touch([NAN, NAN, NAN]))
            feedback = take(client.feedback, 1)
            assert feedback[0].feedback.verdict.refused
            while feedback[-1].feedback.verdict.verdict == "undecided":
                touches.write(Touch(LEVEL))
                feedback += take(client.feedback, 1)
            assert all(one.goal_id == goal for one in feedback)
            assert [one.feedback.verdict.touch for one in feedback] == list(range(len(feedback)))
            answer = client.result.answer()
            assert answer.status == SUCCEEDED and answer.result.verdict == feedback[-1].feedback.verdict
            assert answer.result.verdict.object == "bowl"
        assert client.begin(Goal(["cup"])) is None, "an object that the model does not know is accepted"


def test_a_goal_is_canceled_and_a_change_of_the_thresholds_aborts_it():
    with Node(MODEL) as node:
        peer = Peer(node)
        client, touches = Client(peer), peer.writer("touch", Touch)
        parameters = Service(peer, "set_parameters", SetParametersRequest, SetParametersResponse)
        # The parameters' responses do not wait until the node has found their reader: now it has.
        peer.latched("verdict", Verdict)
        goal = client.begin()
        touches.write(Touch(LEVEL))
        take(client.feedback, 1)
        other = GoalInfo(GoalId(uuid.uuid4().bytes), Time(0, 0))
        assert client.cancel.call(CancelRequest(other)).goals_canceling == []
        answer = client.cancel.call(CancelRequest(GoalInfo(goal, Time(0, 0))))
        assert answer.return_code == 0 and [info.goal_id for info in answer.goals_canceling] == [goal]
        answer = client.result.answer()
        assert answer.status == CANCELED and answer.result.verdict.touch == 1
        client.begin()
        parameters.call(SetParametersRequest([Parameter("max_touches", ParameterValue(2, integer_value=9))]))
        assert client.result.answer().status == ABORTED


def test_three_switches_are_a_touch_of_the_times_that_they_were_published_at():
    with Node(MODEL) as node:
        peer = Peer(node)
        measured, verdicts = peer.reader("measured_touch", Touch), peer.latched("verdict", Verdict)
        switches = [peer.writer(f"switch/{name}", Bool) for name in ("first", "middle", "last")]
        for number in range(1, 4):
            stamps = [0, 0, 0]
            for finger in (1, 0, 2):
                stamps[finger] = time.time_ns()
                switches[finger].write(Bool(True), timestamp=stamps[finger])
                time.sleep(0.03)
            for switch in switches:
                switch.write(Bool(False))
            [touch] = take(measured, 1)
            expected = [(stamp - stamps[1]) / 1e9 for stamp in stamps]
            assert touch.times == pytest.approx(expected, abs=2e-6)
            assert take(verdicts, 1)[0].touch == number
            # As long as the switches have to be open before the next touch.
            time.sleep(0.3)


@pytest.fixture
def chip():
    """A chip at a TCP port whose fingers touch what is typed."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    process = subprocess.Popen([os.environ["PALPATE_CHIP"], MODEL, address], stdin=subprocess.PIPE, text=True)
    process.address = f"tcp://{address}"
    yield process
    process.kill()
    process.wait()


def test_a_chip_behind_a_port_says_the_same_as_the_node(chip):
    drawn = draw(60, seed=4) + [Touch(LEVEL)] * 40 + draw(60, seed=5)
    with Node(MODEL, namespace="/here") as here, Node("--port", chip.address, namespace="/chip") as there:
        of = [(peer.writer("touch", Touch), peer.latched("verdict", Verdict)) for peer in (Peer(here), Peer(there))]
        one, other = [exchange(touches, verdicts, drawn) for touches, verdicts in of]
        assert any(verdict.verdict == "recognized" for verdict in one), "nothing is recognized"
        for mine, its in zip(one, other):
            assert bool(mine.refused) == bool(its.refused)
            if not mine.refused:
                assert (mine.touch, mine.verdict, mine.object) == (its.touch, its.verdict, its.object)
                assert max(abs(a - b) for a, b in zip(mine.posteriors, its.posteriors)) < 1e-12, (mine, its)


def test_fingers_of_a_chip_are_heard_also_after_its_node_started_again(chip):
    for touch in (1, 2):
        with Node("--port", chip.address) as node:
            peer = Peer(node)
            measured, verdicts = peer.reader("measured_touch", Touch), peer.latched("verdict", Verdict)
            diagnostics = peer.reader("/diagnostics", DiagnosticArray)
            until(lambda: take(diagnostics, 1)[0].status[0].level == 0, "the chip is not there")
            chip.stdin.write("0.03 0 -\n")
            chip.stdin.flush()
            [felt], [verdict] = take(measured, 1), take(verdicts, 1)
            assert felt.times[:2] == [0.03, 0.0] and felt.times[2] != felt.times[2]
            assert verdict.touch == touch
            assert node.stop() == 0


def test_a_chip_that_is_gone_is_an_error_in_the_diagnostics(chip):
    with Node("--port", chip.address) as node:
        peer = Peer(node)
        diagnostics = peer.reader("/diagnostics", DiagnosticArray)
        reset = Service(peer, "reset", ResetRequest, ResetResponse)
        until(lambda: take(diagnostics, 1)[0].status[0].level == 0, "the chip is not there")
        assert reset.call(ResetRequest()).success
        assert "own priors" in reset.call(ResetRequest(["bowl"])).message
        chip.kill()
        until(lambda: take(diagnostics, 1)[0].status[0].level == 2, "the chip that is gone is not reported")
        assert chip.address in reset.call(ResetRequest()).message
        verdicts, touches = peer.latched("verdict", Verdict), peer.writer("touch", Touch)
        touches.write(Touch(LEVEL))
        until(lambda: [v for v in take(verdicts, 1) if chip.address in v.refused], "the touch is not refused")
