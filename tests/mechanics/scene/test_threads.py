"""Work that threads share."""

import threading

import pytest

from mechanics.scene.threads import at_once


@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_results_are_in_order_whoever_does_the_work(count):
    assert at_once(3)(pow, range(count), range(count)) == [k**k for k in range(count)]


def test_the_caller_takes_part_beside_the_others():
    together = threading.Barrier(3, timeout=10.0)

    def work(_):
        together.wait()
        return threading.current_thread()

    assert len(set(at_once(3)(work, range(3)))) == 3
    assert threading.current_thread() in at_once(3)(work, range(3))


def test_the_caller_does_what_no_thread_has_begun():
    here, held = threading.current_thread(), threading.Event()

    def work(k):
        if threading.current_thread() is not here:
            held.wait(10.0)
        elif k == 2:
            held.set()
        return threading.current_thread() is here

    # the only other thread waits with the second part, or the fifth, until the third has been done here
    assert at_once(2)(work, range(5))[2]


def test_an_error_of_any_part_reaches_the_caller():
    for k in range(3):
        with pytest.raises(ZeroDivisionError):
            at_once(2)(lambda n, k=k: 1 / (n - k), range(3))
