"""Many clients at once, and many threads on one session."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from conftest import Bar

import softgrasp
from softgrasp import Server

CLIENTS = 8


def test_eight_clients_at_once(program: softgrasp.ServerProgram, bar: Bar) -> None:
    def work(client: int) -> float:
        worst = 0.0
        with Server(program.address, timeout=60.0) as server:
            kept = server.keep(bar.model)
            for frame in range(1, 26):
                factor = 0.1 * frame + client
                answer = kept.frame(bar.case.scaled(factor))
                worst = max(worst, np.abs(answer.displacements - factor * bar.exact).max())
            once = server.solve(bar.model, bar.case.scaled(client))
            return max(worst, np.abs(once.displacements - client * bar.exact).max())

    with ThreadPoolExecutor(CLIENTS) as pool:
        errors = list(pool.map(work, range(CLIENTS)))
    assert len(errors) == CLIENTS and max(errors) < 1e-11


def test_threads_of_one_session_take_turns(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)

    def work(factor: int) -> float:
        answer = kept.frame(bar.case.scaled(factor))
        return float(np.abs(answer.displacements - factor * bar.exact).max())

    with ThreadPoolExecutor(CLIENTS) as pool:
        assert max(pool.map(work, range(60))) < 1e-10
