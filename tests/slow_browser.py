"""Slow machines for the tests in a browser: pages run at a fraction of their speed, and the workbench answers late.

`BROWSER_SLOWDOWN=6 ANSWER_DELAY=0.5 pytest -n 0 -m slow tests/workbench/test_browser.py` looks for tests, and for controls of
pages, that ask something of a state that passes. Neither variable is set in the CI.
"""

from __future__ import annotations

import asyncio
import os
import sys
from typing import Any

CPU_FACTOR = float(os.environ.get("BROWSER_SLOWDOWN", "1"))  # times slower is the page
PATIENCE_MS = 240_000  # ms for what comes sooner or later: a loaded machine is slow, not wrong
ANSWER_DELAY = float(os.environ.get("ANSWER_DELAY", "0"))  # s before an answer of the workbench


def be_patient(browser: Any) -> None:
    """Let contexts of a browser wait longer than the 30 s of Playwright, and run their pages slower where that was asked."""
    make_context = browser.new_context

    def new_context(**options: Any) -> Any:
        context = make_context(**options)
        context.set_default_timeout(PATIENCE_MS)
        make_page = context.new_page

        def new_page() -> Any:
            page = make_page()
            if CPU_FACTOR != 1:
                context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": CPU_FACTOR})
            return page

        context.new_page = new_page
        return context

    browser.new_context = new_context


def serve_command() -> list[str]:
    """Return the words that begin a command of toolpoint whose server may answer late."""
    return [sys.executable, *([__file__] if ANSWER_DELAY else ["-m", "toolpoint"])]


def delay_answers() -> None:
    """Let the workbench of this process answer late."""
    from toolpoint.workbench.serving.guard import Guard

    answer = Guard._answer

    async def late(self: Guard, scope: Any, receive: Any, send: Any) -> None:
        if scope["path"].startswith("/api/"):
            await asyncio.sleep(ANSWER_DELAY)
        await answer(self, scope, receive, send)

    Guard._answer = late  # type: ignore[method-assign]


if __name__ == "__main__":
    delay_answers()
    from toolpoint.app.entry import main

    main()
