"""When a wait begins with a look, and that it ends either way."""

import os
import threading
import time

import pytest

from causeway.waiting import LOOK_SECS, Waiting

WOKEN_SECS = 30e-6


@pytest.fixture
def event():
    descriptor = os.eventfd(0)
    yield descriptor
    os.close(descriptor)


def looks(waiting, waits, took_secs):
    """How often it looks in so many waits, each of which takes so long and a little more asleep."""
    count = 0
    for _ in range(waits):
        looked = waiting.looks()
        if looked:
            count += 1
            waiting.note_look(took_secs < LOOK_SECS)
        if not looked or took_secs >= LOOK_SECS:
            waiting.note_sleep(took_secs + WOKEN_SECS)
    return count


def test_quick_answers_are_looked_for_each_time():
    assert looks(Waiting([]), 1_000, 8e-6) == 1_000


def test_slow_answers_are_looked_for_once_and_quick_ones_again_after_them():
    waiting = Waiting([])
    assert looks(waiting, 1_000, 1e-3) == 1
    assert looks(waiting, 1_000, 8e-6) > 990


def test_answers_that_come_a_little_too_late_are_looked_for_ever_more_rarely():
    waiting = Waiting([])
    assert looks(waiting, 512, 60e-6) < 10
    assert looks(waiting, 10_000, 60e-6) < 42


def test_an_answer_ends_the_wait_whether_it_is_there_or_comes_late(event):
    waiting = Waiting([event])
    os.eventfd_write(event, 1)
    assert [descriptor for descriptor, _ in waiting.wait(5.0)] == [event]
    os.eventfd_read(event)
    later = threading.Timer(0.05, os.eventfd_write, (event, 1))
    later.start()
    assert [descriptor for descriptor, _ in waiting.wait(5.0)] == [event]
    later.join()


def test_a_wait_ends_after_its_time(event):
    begun = time.monotonic()
    assert Waiting([event]).wait(0.05) == []
    assert 0.04 < time.monotonic() - begun < 2.0
