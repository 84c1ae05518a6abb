"""The same job by clicking: a page on this computer only. Needs the extra `web` (NiceGUI)."""

from __future__ import annotations

from toolkit.errors import JobError, UsageError


def serve(port: int = 8080, *, show: bool = True) -> None:
    """Serve the page at http://127.0.0.1:PORT until stopped; `show` opens a browser.

    Raises JobError where NiceGUI is not installed or the port is taken, UsageError for an impossible port.
    """
    import socket

    if not 1 <= port <= 65535:
        raise UsageError(f"--port must lie between 1 and 65535, got {port}")
    try:
        from nicegui import ui
    except ImportError as error:
        raise JobError("the web page needs one more package: pip install 'pendulab[web]'") from error
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", port)) == 0:
            raise JobError(f"port {port} is in use; choose another with --port")
    from toolkit.web.page import build_page

    ui.run(
        build_page,
        host="127.0.0.1",
        port=port,
        title="pendulab",
        show=show,
        reload=False,
        show_welcome_message=False,
        dark=None,
    )
