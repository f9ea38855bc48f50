"""Certificates made by openssl, and tokens made by `wade token`."""

from __future__ import annotations

import subprocess
from pathlib import Path

from servers import binary, environment

import wade

#: Names under which a server on this machine may be called.
OURS = "subjectAltName=DNS:localhost,IP:127.0.0.1"
#: What a client's certificate is for.
CLIENT = "extendedKeyUsage=clientAuth"

_CURVE = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")


class Authority:
    """Signs certificates in a folder; has a file of tokens there."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.ca, self.tokens = folder / "ca.pem", folder / "tokens.toml"
        self._openssl("req", "-x509", "-days", "2", "-subj", "/CN=ca", "-keyout", "ca.key", "-out", "ca.pem", *_CURVE)

    def sign(self, name: str, extension: str, days: int = 2) -> None:
        """Writes NAME.pem and NAME.key, valid until so many days from now."""
        (self.folder / f"{name}.ext").write_text(f"{extension}\n")
        self._openssl("req", "-subj", f"/CN={name}", "-keyout", f"{name}.key", "-out", f"{name}.csr", *_CURVE)
        signs = ("x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial")
        self._openssl(*signs, "-days", str(days), "-extfile", f"{name}.ext", "-out", f"{name}.pem")

    def files(self, name: str) -> tuple[Path, Path]:
        """The certificate of a name and its key."""
        return self.folder / f"{name}.pem", self.folder / f"{name}.key"

    def tls(self, name: str | None = None, *, server_name: str | None = None) -> wade.Tls:
        """What a client has that trusts this authority and shows the certificate of a name."""
        return wade.Tls.from_files(self.ca, *(self.files(name) if name else ()), server_name=server_name)

    def token(self, name: str, role: str) -> str:
        """Adds a token to the file."""
        command: list[str | Path] = [binary(), "token", name, "--roles", role, "--file", self.tokens]
        made = subprocess.run(command, check=True, capture_output=True, text=True, env=environment())
        return made.stdout.strip()

    def settings(self, name: str) -> str:
        """Those of a server that shows the certificate of a name and believes this authority."""
        certificate, key = self.files(name)
        return f'[tls]\ncertificate = "{certificate}"\nkey = "{key}"\nclient_ca = "{self.ca}"\n'

    def _openssl(self, *arguments: str) -> None:
        subprocess.run(["openssl", *arguments], check=True, capture_output=True, cwd=self.folder)
