from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class ReloadRequest(_message.Message):
    __slots__ = ("vehicle", "bundle")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    bundle: str
    def __init__(self, vehicle: _Optional[str] = ..., bundle: _Optional[str] = ...) -> None: ...

class ReloadResponse(_message.Message):
    __slots__ = ("vehicles",)
    VEHICLES_FIELD_NUMBER: _ClassVar[int]
    vehicles: _containers.RepeatedCompositeFieldContainer[Reloaded]
    def __init__(self, vehicles: _Optional[_Iterable[_Union[Reloaded, _Mapping]]] = ...) -> None: ...

class Reloaded(_message.Message):
    __slots__ = ("vehicle", "bundle_version", "refusal", "elsewhere")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_VERSION_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    ELSEWHERE_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    bundle_version: int
    refusal: str
    elsewhere: bool
    def __init__(self, vehicle: _Optional[str] = ..., bundle_version: _Optional[int] = ..., refusal: _Optional[str] = ..., elsewhere: bool = ...) -> None: ...
