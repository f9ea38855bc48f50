"""The version of this package, of the compiled module that it works with, and of the server that it is made with."""

VERSION = "0.2.0"
