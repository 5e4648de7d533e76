"""One side's end of the conversation: a request as a JSON line in, an answer as a JSON line out."""

import json
import sys
import time


def serve(handlers):
    """Answers requests by the handler that their `ask` names, until the input ends."""
    for line in sys.stdin:
        request = json.loads(line)
        answer = handlers[request.pop("ask")](**request)
        print(json.dumps(answer), flush=True)


def timed_ms(work, *arguments, **named):
    """Milliseconds of one call, and what it returned."""
    start = time.perf_counter()
    result = work(*arguments, **named)
    return (time.perf_counter() - start) * 1e3, result


def dgemm_gflops(dgemm, size=1500, rounds=3):
    """Rate of a library's own product of two matrices: which instructions it chose shows here."""
    dgemm(size)
    return max(2e-6 * size**3 / timed_ms(dgemm, size)[0] for _ in range(rounds))
