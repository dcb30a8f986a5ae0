"""Who is answered: every request of another site, host or program is refused, and no name leads out of the project."""

import json
import os
import socket
import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.io.template_files import read_template
from toolpoint.project import add_part, draft_test
from toolpoint.project.components_text import draft_components
from toolpoint.workbench.serving.server import _listen
from toolpoint.workbench.state.access import Access, check_file_name, keep_token, path_beneath

ACCESS = Access("token-0123456789-0123456789", 4711)
COOKIE = f"{ACCESS.cookie_name}={ACCESS.cookie_value}"


def headers(**values):
    good = {"host": ["127.0.0.1:4711"], "cookie": [COOKIE], "origin": ["http://127.0.0.1:4711"],
            "content-type": ["application/json"]}
    return {**good, **{name.replace("_", "-"): value for name, value in values.items()}}


def test_what_the_page_sends_is_answered():
    assert ACCESS.refusal("POST", "/api/job", headers()) is None
    assert ACCESS.refusal("GET", "/api/view/project", headers(origin=[])) is None
    assert ACCESS.refusal("GET", "/api/view/project", headers(host=["localhost:4711"], origin=[])) is None
    assert ACCESS.refusal("PUT", "/api/file/a.csv", headers(content_type=["application/octet-stream"])) is None


@pytest.mark.parametrize("host", [[], ["evil.example:4711"], ["127.0.0.1"], ["127.0.0.1:80"],
                                  ["127.0.0.1:4711", "evil.example"],
                                  ["127.0.0.1.evil.example:4711"], ["evil.example"], ["0.0.0.0:4711"]])
def test_a_foreign_name_that_resolves_to_this_machine_is_refused(host):
    """DNS rebinding: the page of the foreign name sends that name as host, and as origin."""
    for path in ("/", "/web/main.js", "/api/view/project"):
        assert ACCESS.refusal("GET", path, headers(host=host, origin=["http://" + (host or ["x"])[0]])).status == 403


@pytest.mark.parametrize("origin", [["http://evil.example"], ["null"], ["http://127.0.0.1:80"], ["https://127.0.0.1:4711"],
                                    ["http://127.0.0.1:4711.evil.example"], ["http://127.0.0.1:4711", "http://evil.example"]])
@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE"])
def test_another_origin_is_refused(method, origin):
    assert ACCESS.refusal(method, "/api/job", headers(origin=origin)).status == 403


def test_a_change_must_say_its_origin_and_be_of_a_kind_that_no_form_sends():
    assert ACCESS.refusal("POST", "/api/job", headers(origin=[])).status == 403
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
        assert ACCESS.refusal("POST", "/api/job", headers(content_type=[kind])).status == 415
    assert ACCESS.refusal("TRACE", "/api/job", headers()).status == 405
    assert ACCESS.refusal("OPTIONS", "/api/job", headers()).status == 405


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_the_browsers_own_word_on_where_a_request_comes_from_is_heard(site):
    assert ACCESS.refusal("GET", "/page/report", headers(origin=[], sec_fetch_site=[site])).status == 403


@pytest.mark.parametrize("cookie", [[], [f"{ACCESS.cookie_name}="], [f"{ACCESS.cookie_name}=" + "0" * 64], ["toolpoint_80=x"],
                                    ["=;=;\x00"], [f"{ACCESS.cookie_name}={ACCESS.token}"]])
def test_without_the_cookie_nothing_of_the_project_is_told(cookie):
    for path in ("/api/view/project", "/api/events", "/page/report", "/api/job"):
        assert ACCESS.refusal("GET", path, headers(origin=[], cookie=cookie)).status == 401


def test_the_cookie_is_not_the_token():
    assert ACCESS.token not in ACCESS.cookie_value and ACCESS.has_token(ACCESS.token)
    assert not any(ACCESS.has_token(text) for text in ("", ACCESS.token[:-1], ACCESS.cookie_value, None, 3))


@pytest.mark.parametrize("name", ["../x.csv", "a/b.csv", "a\\b.csv", "..", ".", "", ".hidden", "~x", "-rf", "con.csv", "NUL",
                                  "a\0b", "a\nb", "a\u202eb", "x" * 121, "x.", " x", "C:x", "a*b", "\u200bx"])
def test_names_that_lead_out_hide_or_trick_are_refused(name):
    with pytest.raises(ToolpointError, match="name of the file"):
        check_file_name(name)


@given(st.text(max_size=130))
def test_every_name_that_is_taken_lies_in_its_folder(name):
    try:
        taken = check_file_name(name)
    except ToolpointError:
        return
    place = Path("/project/incoming") / taken
    assert Path(os.path.normpath(place)).parent == Path("/project/incoming") and not taken.startswith(".")


def test_no_path_and_no_link_leads_out_of_the_project(tmp_path):
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "secret.yaml").write_text("x")
    (root / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    for path in ("../secret.yaml", "/etc/passwd", "a/../../secret.yaml", "link.yaml"):
        with pytest.raises(ToolpointError, match="outside the project"):
            path_beneath(root, path)
    assert path_beneath(root, "results/machine.yaml") == root.resolve() / "results/machine.yaml"


@pytest.mark.skipif(os.name == "nt", reason="modes of files are POSIX")
def test_the_token_is_readable_by_its_owner_alone_and_stays(tmp_path):
    token = keep_token(tmp_path / "state/token")
    assert stat.S_IMODE((tmp_path / "state/token").stat().st_mode) == 0o600 and len(token) >= 32
    assert keep_token(tmp_path / "state/token") == token
    (tmp_path / "state/token").write_text("short")
    assert keep_token(tmp_path / "state/token") not in (token, "short")


def test_the_server_refuses_what_access_refuses(running):
    ask = running.client.ask
    good = ("GET", "/api/view/project")
    status, sent, content = ask(*good)
    assert status == 200 and json.loads(content)["name"] == "project"
    assert "access-control-allow-origin" not in sent and "default-src 'none'" in sent["content-security-policy"]
    assert sent["x-content-type-options"] == "nosniff" and sent["cache-control"] == "no-store"
    assert ask(*good, Host="evil.example")[0] == 403
    assert ask(*good, Cookie=None)[0] == 401
    assert ask(*good, Origin="http://evil.example")[0] == 403
    assert ask("POST", "/api/job", {}, Origin=None)[0] == 403
    assert ask("POST", "/api/job", {}, Content_Type="text/plain")[0] == 415
    assert ask("POST", "/api/session", {"token": "wrong"}, Cookie=None)[0] == 401
    status, sent, _ = ask("POST", "/api/session", {"token": running.bench.access.token}, Cookie=None)
    assert status == 204
    assert all(word in sent["set-cookie"].lower() for word in ("httponly", "samesite=strict", "path=/"))
    assert running.bench.jobs.job.state == ""


@pytest.mark.parametrize("path", ["/web/../pyproject.toml", "/web/..%2f..%2fworkbench.css", "/web/%2e%2e/routes.py",
                                  "/web/access.py", "/web//etc/passwd",
                                  "/page/../../etc/passwd", "/page/%2fetc%2fpasswd", "/project.yaml",
                                  "/.toolpoint/workbench/token", "/api/view/..%2ftoken"])
def test_only_files_of_the_page_are_served(running, path):
    status, _, content = running.client.ask("GET", path)
    assert status in (404, 422) and b"root:" not in content and running.bench.access.token.encode() not in content


def test_oversize_is_refused_whether_it_is_stated_or_not(running, monkeypatch):
    from toolpoint.workbench.serving import guard, intake_routes

    ask = running.client.ask
    assert ask("POST", "/api/part", b" " * 1_000_001)[0] in (0, 413)
    assert ask("PUT", "/api/file/a.csv", b"", Content_Length="500000001")[0] in (0, 413)
    assert ask("PUT", "/api/file/a.csv", b"", Content_Length="many")[0] == 400
    monkeypatch.setattr(guard, "MAX_FILE_BYTES", 1000)
    monkeypatch.setattr(intake_routes, "MAX_FILE_BYTES", 1000)
    chunks = b"".join(b"%x\r\n%s\r\n" % (400, b"x" * 400) for _ in range(4)) + b"0\r\n\r\n"
    assert ask("PUT", "/api/file/a.csv", chunks, Transfer_Encoding="chunked")[0] in (0, 413)
    assert not list(running.bench.desk.folder.glob("incoming/*"))
    monkeypatch.setattr(guard, "MAX_JSON_BYTES", 40)
    text, before = b'{"place": "goals.x", "value": "{speed: 900 rpm, depth: 1 mm}"}', running.bench.desk.folder / "project.yaml"
    kept = before.read_bytes()
    assert ask("POST", "/api/part", b"%x\r\n%s\r\n0\r\n\r\n" % (len(text), text), Transfer_Encoding="chunked")[0] in (0, 413)
    assert before.read_bytes() == kept  # what is too large is not worked on


@pytest.mark.parametrize("name", ["..%2f..%2fx.csv", "%2e%2e%2fproject.yaml", "a%00b.csv", ".hidden", "a%5Cb.csv",
                                  "%E2%80%AEgnp.csv"])
def test_hostile_names_of_handed_files_are_refused(running, name):
    before = sorted(path.name for path in running.bench.desk.folder.parent.rglob("*.csv"))
    assert running.client.ask("PUT", f"/api/file/{name}", b"1,2\n")[0] == 422
    assert sorted(path.name for path in running.bench.desk.folder.parent.rglob("*.csv")) == before


@pytest.mark.parametrize("content", [b"[" * 200_000, b"\xff\xfe{", b"{\"steps\": 3}", b"{\"steps\": [{}]}", b"[]", b"nul", b""])
def test_hostile_content_is_answered_and_starts_nothing(running, content):
    status = running.client.ask("POST", "/api/part", content)[0]
    assert status == 422
    for body in ({"values": {"a": "b"}}, {"values": [1]}, {"pose": {"X": 1e400}}, {"values": {"x": None}}, {"pose": {"Q": 1.0}},
                 {"values": {"joints.none.stiffness.x": 1.0}}, {"mode": "x"}, {"values": {"__class__.x": 1.0}}):
        text = json.dumps(body).encode()
        assert running.client.ask("POST", "/api/machine/look", text)[0] == 422


def test_a_choice_of_poles_for_what_is_no_test_is_refused_and_writes_nothing(running):
    folder = running.bench.desk.folder
    text = "toolpoint: 1\nremove:\n  - 20 Hz\n"
    for test in ("../outside", "", "structure", "a/b"):
        status, _, content = running.client.ask("POST", "/api/choice", {"test": test, "text": text})
        assert status == 422 and b"must be one whose modes are identified here" in content, test
    assert running.client.ask("POST", "/api/choice", {"test": "a"})[0] == 422
    assert not (folder / "choices").exists() and not (folder.parent / "outside.yaml").exists()


def test_the_content_of_an_answer_is_not_held_back():
    """Asyncio switches Nagle's algorithm off for sockets that name their protocol; else an answer waits 40 ms."""
    with _listen("127.0.0.1", 0) as listener:
        assert (listener.type, listener.proto) == (socket.SOCK_STREAM, socket.IPPROTO_TCP)


def test_the_components_text_neither_shows_nor_writes_a_file_outside_the_project(running):
    folder = running.bench.desk.folder
    secret = folder.parent / "secret.yaml"
    secret.write_text("a secret\n")
    text = read_template("components")
    for place in ("../secret.yaml", str(secret)):
        add_part(folder, "components", place)
        assert "secret" not in draft_components(folder)
        status, _, content = running.client.ask("POST", "/api/components", {"text": text})
        assert status == 422 and b"outside the project" in content and secret.read_text() == "a secret\n"


def test_a_test_of_records_reads_and_names_nothing_outside_the_project(running):
    folder = running.bench.desk.folder
    outside = folder.parent / "outside.csv"
    outside.write_text("time [s],hidden [N]\n0,1\n0.001,2\n")
    (folder / "records").mkdir(exist_ok=True)
    (folder / "records" / "linked.csv").symlink_to(outside)
    assert draft_test(folder) is None
    body = {"name": "a", "of": "structure", "pattern": "", "struck": "", "channels": ["1=force 1:+x"]}
    before = (folder / "project.yaml").read_bytes()
    for records in (["../outside.csv"], [str(outside)], ["records/linked.csv"], ["records/*"], ["\0"], [""], []):
        status, _, content = running.client.ask("POST", "/api/test", {**body, "records": records})
        assert status == 422 and b"in the project" in content, records
    for change in ({"records": "records/*"}, {"channels": [1]}, {"of": "x"}, {"name": 3}, {"channels": ["x" * 300]}):
        assert running.client.ask("POST", "/api/test", {**body, "records": ["records/*"], **change})[0] == 422, change
    assert (folder / "project.yaml").read_bytes() == before
