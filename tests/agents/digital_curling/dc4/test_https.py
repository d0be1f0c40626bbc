"""Version 4 over https: trusted and untrusted certificates."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="make setup installs it")

from curling_env.errors import InputError
from curling_env.game import DrawPlayer
from curling_env.infrastructure import Certificate
from tests.agents.digital_curling.dc4.web_hosting import PASSWORDS, WebHost

RULES = "dc4_server_mixed_doubles"


def openssl(*words: str | Path) -> None:
    subprocess.run(["openssl", *map(str, words)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make self-signed certificates: of this machine, and of another one."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificates")
    made = tmp_path_factory.mktemp("certificates")
    curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1")
    for name in ("localhost", "elsewhere"):
        subject = ("-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}")
        files = ("-keyout", made / f"{name}.key", "-out", made / f"{name}.pem")
        openssl("req", "-x509", *curve, "-noenc", "-days", "9", *subject, *files)
    locked = ("-passout", "pass:secret", "-out", made / "locked.key")
    openssl("ec", "-in", made / "localhost.key", "-aes128", *locked)
    both = (made / "localhost.pem").read_text() + (made / "localhost.key").read_text()
    (made / "both.pem").write_text(both)
    (made / "text.pem").write_text("no certificate")
    return made


def certificate(folder: Path, name: str = "localhost", key: str | None = None) -> Certificate:
    return Certificate(certificate=folder / f"{name}.pem", key=folder / f"{key or name}.key")


@pytest.mark.parametrize(
    ("name", "key", "says"),
    [
        ("nothing.pem", None, "cannot be read: no such file"),
        ("localhost.pem", "nothing.key", "cannot be read: no such file"),
        ("localhost.pem", "elsewhere.key", "does not belong to the private key"),
        ("localhost.pem", "locked.key", "has a passphrase"),
        ("text.pem", None, "expected a certificate and its private key"),
        ("localhost.pem", None, "expected a certificate and its private key"),  # it has no key
        (".", None, "cannot be read"),
    ],
)
def test_an_invalid_certificate_is_refused(folder, name, key, says):
    with pytest.raises(InputError, match=says):
        Certificate(certificate=folder / name, key=None if key is None else folder / key)


def test_certificate_and_key_may_be_in_one_file(folder):
    assert Certificate(certificate=folder / "both.pem").key is None


@pytest.fixture
def join(curling, monkeypatch):
    """Run `curling join` for anna's team in a host's match."""
    monkeypatch.setenv("CURLING_PASSWORD", PASSWORDS["anna"])
    monkeypatch.setattr("agents.digital_curling.dc4.web_host.RESULT_SECONDS", 0.05)

    def run(host: WebHost, *words: str | Path, url: str | None = None):
        options = ["--match", host.hosting.game_id, "--user", "anna", "--player", "draw"]
        return curling("join", url or host.url, *options, *words)

    return run


def test_a_game_over_https(join, folder):
    with WebHost(
        None, DrawPlayer(), certificate=certificate(folder), ends=1, rule_name=RULES
    ) as host:
        # First refused clients: the certificate is not trusted, it is another's, or
        # the words are not those of https.
        unknown = join(host).complaint
        assert unknown.startswith(f"{host.url}: the server's certificate is not trusted: self")
        assert "--certificate FILE.pem" in unknown
        trusts = ("--certificate", folder / "localhost.pem")
        other = join(host, *trusts, url=host.url.replace("localhost", "127.0.0.1")).complaint
        assert "127.0.0.1" in other
        assert "not trusted: ip address mismatch" in other.lower()
        assert "not trusted" in join(host, "--certificate", folder / "elsewhere.pem").complaint
        assert "in PEM form" in join(host, "--certificate", folder / "text.pem").complaint
        plain = join(host, url=host.url.replace("https", "http").replace("localhost", "127.0.0.1"))
        assert "no answer" in plain.complaint
        out = join(host, *trusts)
    assert out.status == 0, out.err
    assert out.json()["winner"] == host.game.result["winner"]
    assert "unencrypted" not in out.err


def test_a_host_without_https_is_no_host_with_it(join):
    with WebHost(None, DrawPlayer(), ends=1, rule_name=RULES) as host:
        secure = join(host, url=host.url.replace("http", "https"))
        assert "does not support https there" in secure.complaint
        assert join(host).status == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--key", "k.pem"], "--key needs a --certificate"),
        (["--certificate", "c.pem"], "needs --http"),
        (["--certificate", "c.pem", "--http", "0"], "c.pem: cannot be read"),
    ],
)
def test_a_host_reports_options_that_do_not_fit(words, says, curling):
    assert says in curling("host", "--team0", "draw", "--team1", "draw", *words).complaint
