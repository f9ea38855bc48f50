from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class GroundContact(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    GROUND_CONTACT_UNSPECIFIED: _ClassVar[GroundContact]
    GROUND_CONTACT_WETTED: _ClassVar[GroundContact]
    GROUND_CONTACT_DRY: _ClassVar[GroundContact]

class Physics(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    PHYSICS_UNSPECIFIED: _ClassVar[Physics]
    PHYSICS_HYDROSTATIC: _ClassVar[Physics]
    PHYSICS_QUASI_STEADY: _ClassVar[Physics]
    PHYSICS_FULL: _ClassVar[Physics]

class Effect(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    EFFECT_UNSPECIFIED: _ClassVar[Effect]
    EFFECT_ADDED_MASS: _ClassVar[Effect]
    EFFECT_LINEAR_DAMPING: _ClassVar[Effect]
    EFFECT_DRAG_COEFFICIENT_ERROR: _ClassVar[Effect]
    EFFECT_ROTATION: _ClassVar[Effect]
    EFFECT_CURRENT: _ClassVar[Effect]
    EFFECT_WATER_LEVEL_OFFSET: _ClassVar[Effect]
    EFFECT_DENSITY_ERROR: _ClassVar[Effect]
    EFFECT_HULL_FLOODING: _ClassVar[Effect]
    EFFECT_WATER_ENTRY_SLAMMING: _ClassVar[Effect]
    EFFECT_WAVE_MEMORY: _ClassVar[Effect]
    EFFECT_CHANNEL_BLOCKAGE: _ClassVar[Effect]
    EFFECT_SQUAT: _ClassVar[Effect]
    EFFECT_WHEEL_PADDLE_THRUST: _ClassVar[Effect]
    EFFECT_BED_MOTION: _ClassVar[Effect]
    EFFECT_HULL_LIFT: _ClassVar[Effect]

class LeftOut(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    LEFT_OUT_UNSPECIFIED: _ClassVar[LeftOut]
    LEFT_OUT_NO_SESSION: _ClassVar[LeftOut]
    LEFT_OUT_NO_HEADING: _ClassVar[LeftOut]
    LEFT_OUT_NO_WHEEL_SPEEDS: _ClassVar[LeftOut]
    LEFT_OUT_NO_DEPTH_RATE: _ClassVar[LeftOut]
    LEFT_OUT_CURRENT_STATED: _ClassVar[LeftOut]

class BoxQuantity(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    BOX_QUANTITY_UNSPECIFIED: _ClassVar[BoxQuantity]
    BOX_QUANTITY_DEPTH: _ClassVar[BoxQuantity]
    BOX_QUANTITY_SPEED: _ClassVar[BoxQuantity]
    BOX_QUANTITY_ACCELERATION: _ClassVar[BoxQuantity]
    BOX_QUANTITY_ANGULAR_SPEED: _ClassVar[BoxQuantity]
    BOX_QUANTITY_DENSITY: _ClassVar[BoxQuantity]

class Quantity(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    QUANTITY_UNSPECIFIED: _ClassVar[Quantity]
    QUANTITY_SPEED: _ClassVar[Quantity]
    QUANTITY_ANGLE: _ClassVar[Quantity]
    QUANTITY_DENSITY: _ClassVar[Quantity]
    QUANTITY_DEPTH: _ClassVar[Quantity]
    QUANTITY_TILT: _ClassVar[Quantity]
    QUANTITY_VERTICAL_SPEED: _ClassVar[Quantity]
    QUANTITY_ANGULAR_SPEED: _ClassVar[Quantity]
    QUANTITY_DISTANCE: _ClassVar[Quantity]
GROUND_CONTACT_UNSPECIFIED: GroundContact
GROUND_CONTACT_WETTED: GroundContact
GROUND_CONTACT_DRY: GroundContact
PHYSICS_UNSPECIFIED: Physics
PHYSICS_HYDROSTATIC: Physics
PHYSICS_QUASI_STEADY: Physics
PHYSICS_FULL: Physics
EFFECT_UNSPECIFIED: Effect
EFFECT_ADDED_MASS: Effect
EFFECT_LINEAR_DAMPING: Effect
EFFECT_DRAG_COEFFICIENT_ERROR: Effect
EFFECT_ROTATION: Effect
EFFECT_CURRENT: Effect
EFFECT_WATER_LEVEL_OFFSET: Effect
EFFECT_DENSITY_ERROR: Effect
EFFECT_HULL_FLOODING: Effect
EFFECT_WATER_ENTRY_SLAMMING: Effect
EFFECT_WAVE_MEMORY: Effect
EFFECT_CHANNEL_BLOCKAGE: Effect
EFFECT_SQUAT: Effect
EFFECT_WHEEL_PADDLE_THRUST: Effect
EFFECT_BED_MOTION: Effect
EFFECT_HULL_LIFT: Effect
LEFT_OUT_UNSPECIFIED: LeftOut
LEFT_OUT_NO_SESSION: LeftOut
LEFT_OUT_NO_HEADING: LeftOut
LEFT_OUT_NO_WHEEL_SPEEDS: LeftOut
LEFT_OUT_NO_DEPTH_RATE: LeftOut
LEFT_OUT_CURRENT_STATED: LeftOut
BOX_QUANTITY_UNSPECIFIED: BoxQuantity
BOX_QUANTITY_DEPTH: BoxQuantity
BOX_QUANTITY_SPEED: BoxQuantity
BOX_QUANTITY_ACCELERATION: BoxQuantity
BOX_QUANTITY_ANGULAR_SPEED: BoxQuantity
BOX_QUANTITY_DENSITY: BoxQuantity
QUANTITY_UNSPECIFIED: Quantity
QUANTITY_SPEED: Quantity
QUANTITY_ANGLE: Quantity
QUANTITY_DENSITY: Quantity
QUANTITY_DEPTH: Quantity
QUANTITY_TILT: Quantity
QUANTITY_VERTICAL_SPEED: Quantity
QUANTITY_ANGULAR_SPEED: Quantity
QUANTITY_DISTANCE: Quantity

class Vector3(_message.Message):
    __slots__ = ("x", "y", "z")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class Quaternion(_message.Message):
    __slots__ = ("w", "x", "y", "z")
    W_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    w: float
    x: float
    y: float
    z: float
    def __init__(self, w: _Optional[float] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class RollPitch(_message.Message):
    __slots__ = ("roll_rad", "pitch_rad")
    ROLL_RAD_FIELD_NUMBER: _ClassVar[int]
    PITCH_RAD_FIELD_NUMBER: _ClassVar[int]
    roll_rad: float
    pitch_rad: float
    def __init__(self, roll_rad: _Optional[float] = ..., pitch_rad: _Optional[float] = ...) -> None: ...

class State(_message.Message):
    __slots__ = ("velocity_mps", "current_mps", "angular_velocity_radps", "acceleration_mps2", "angular_acceleration_radps2", "depth_m", "density_kgpm3", "gravity_direction", "world_from_body", "roll_pitch", "ground_contact", "heading_rad", "depth_rate_mps", "wheel_speed_radps", "time_step_s", "implicit_added_mass", "water_level_m", "bed_clearance_m", "bed", "physics", "jacobian", "wave_vector_radpm", "wave_amplitude_m", "wave_phase_rad", "wheel_water_level_m", "current_exponent")
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    CURRENT_MPS_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    ACCELERATION_MPS2_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_ACCELERATION_RADPS2_FIELD_NUMBER: _ClassVar[int]
    DEPTH_M_FIELD_NUMBER: _ClassVar[int]
    DENSITY_KGPM3_FIELD_NUMBER: _ClassVar[int]
    GRAVITY_DIRECTION_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_BODY_FIELD_NUMBER: _ClassVar[int]
    ROLL_PITCH_FIELD_NUMBER: _ClassVar[int]
    GROUND_CONTACT_FIELD_NUMBER: _ClassVar[int]
    HEADING_RAD_FIELD_NUMBER: _ClassVar[int]
    DEPTH_RATE_MPS_FIELD_NUMBER: _ClassVar[int]
    WHEEL_SPEED_RADPS_FIELD_NUMBER: _ClassVar[int]
    TIME_STEP_S_FIELD_NUMBER: _ClassVar[int]
    IMPLICIT_ADDED_MASS_FIELD_NUMBER: _ClassVar[int]
    WATER_LEVEL_M_FIELD_NUMBER: _ClassVar[int]
    BED_CLEARANCE_M_FIELD_NUMBER: _ClassVar[int]
    BED_FIELD_NUMBER: _ClassVar[int]
    PHYSICS_FIELD_NUMBER: _ClassVar[int]
    JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    WAVE_VECTOR_RADPM_FIELD_NUMBER: _ClassVar[int]
    WAVE_AMPLITUDE_M_FIELD_NUMBER: _ClassVar[int]
    WAVE_PHASE_RAD_FIELD_NUMBER: _ClassVar[int]
    WHEEL_WATER_LEVEL_M_FIELD_NUMBER: _ClassVar[int]
    CURRENT_EXPONENT_FIELD_NUMBER: _ClassVar[int]
    velocity_mps: Vector3
    current_mps: Vector3
    angular_velocity_radps: Vector3
    acceleration_mps2: Vector3
    angular_acceleration_radps2: Vector3
    depth_m: float
    density_kgpm3: float
    gravity_direction: Vector3
    world_from_body: Quaternion
    roll_pitch: RollPitch
    ground_contact: GroundContact
    heading_rad: float
    depth_rate_mps: float
    wheel_speed_radps: _containers.RepeatedScalarFieldContainer[float]
    time_step_s: float
    implicit_added_mass: bool
    water_level_m: float
    bed_clearance_m: float
    bed: float
    physics: Physics
    jacobian: bool
    wave_vector_radpm: Vector3
    wave_amplitude_m: float
    wave_phase_rad: float
    wheel_water_level_m: _containers.RepeatedScalarFieldContainer[float]
    current_exponent: float
    def __init__(self, velocity_mps: _Optional[_Union[Vector3, _Mapping]] = ..., current_mps: _Optional[_Union[Vector3, _Mapping]] = ..., angular_velocity_radps: _Optional[_Union[Vector3, _Mapping]] = ..., acceleration_mps2: _Optional[_Union[Vector3, _Mapping]] = ..., angular_acceleration_radps2: _Optional[_Union[Vector3, _Mapping]] = ..., depth_m: _Optional[float] = ..., density_kgpm3: _Optional[float] = ..., gravity_direction: _Optional[_Union[Vector3, _Mapping]] = ..., world_from_body: _Optional[_Union[Quaternion, _Mapping]] = ..., roll_pitch: _Optional[_Union[RollPitch, _Mapping]] = ..., ground_contact: _Optional[_Union[GroundContact, str]] = ..., heading_rad: _Optional[float] = ..., depth_rate_mps: _Optional[float] = ..., wheel_speed_radps: _Optional[_Iterable[float]] = ..., time_step_s: _Optional[float] = ..., implicit_added_mass: bool = ..., water_level_m: _Optional[float] = ..., bed_clearance_m: _Optional[float] = ..., bed: _Optional[float] = ..., physics: _Optional[_Union[Physics, str]] = ..., jacobian: bool = ..., wave_vector_radpm: _Optional[_Union[Vector3, _Mapping]] = ..., wave_amplitude_m: _Optional[float] = ..., wave_phase_rad: _Optional[float] = ..., wheel_water_level_m: _Optional[_Iterable[float]] = ..., current_exponent: _Optional[float] = ...) -> None: ...

class BaseAnswer(_message.Message):
    __slots__ = ("water_level_m", "bed_clearance_m", "bed", "shaft_power_w", "damping")
    WATER_LEVEL_M_FIELD_NUMBER: _ClassVar[int]
    BED_CLEARANCE_M_FIELD_NUMBER: _ClassVar[int]
    BED_FIELD_NUMBER: _ClassVar[int]
    SHAFT_POWER_W_FIELD_NUMBER: _ClassVar[int]
    DAMPING_FIELD_NUMBER: _ClassVar[int]
    water_level_m: float
    bed_clearance_m: float
    bed: float
    shaft_power_w: float
    damping: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, water_level_m: _Optional[float] = ..., bed_clearance_m: _Optional[float] = ..., bed: _Optional[float] = ..., shaft_power_w: _Optional[float] = ..., damping: _Optional[_Iterable[float]] = ...) -> None: ...

class EvaluateRequest(_message.Message):
    __slots__ = ("vehicle", "state")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    state: State
    def __init__(self, vehicle: _Optional[str] = ..., state: _Optional[_Union[State, _Mapping]] = ...) -> None: ...

class EvaluateResponse(_message.Message):
    __slots__ = ("surface_force_n", "surface_point_m", "wetted_fraction", "wrench", "uncertainty_n", "in_domain", "outside", "bundle_version", "provenance", "compute_ns", "effects", "effect_surface_force_n", "effects_outside", "added_mass", "surface_couple_nm", "moment_uncertainty_nm", "base", "jacobian")
    SURFACE_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    SURFACE_POINT_M_FIELD_NUMBER: _ClassVar[int]
    WETTED_FRACTION_FIELD_NUMBER: _ClassVar[int]
    WRENCH_FIELD_NUMBER: _ClassVar[int]
    UNCERTAINTY_N_FIELD_NUMBER: _ClassVar[int]
    IN_DOMAIN_FIELD_NUMBER: _ClassVar[int]
    OUTSIDE_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_VERSION_FIELD_NUMBER: _ClassVar[int]
    PROVENANCE_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_NS_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_FIELD_NUMBER: _ClassVar[int]
    EFFECT_SURFACE_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_OUTSIDE_FIELD_NUMBER: _ClassVar[int]
    ADDED_MASS_FIELD_NUMBER: _ClassVar[int]
    SURFACE_COUPLE_NM_FIELD_NUMBER: _ClassVar[int]
    MOMENT_UNCERTAINTY_NM_FIELD_NUMBER: _ClassVar[int]
    BASE_FIELD_NUMBER: _ClassVar[int]
    JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    surface_force_n: _containers.RepeatedScalarFieldContainer[float]
    surface_point_m: _containers.RepeatedScalarFieldContainer[float]
    wetted_fraction: _containers.RepeatedScalarFieldContainer[float]
    wrench: Wrench
    uncertainty_n: Vector3
    in_domain: bool
    outside: _containers.RepeatedCompositeFieldContainer[Outside]
    bundle_version: int
    provenance: str
    compute_ns: int
    effects: _containers.RepeatedCompositeFieldContainer[EffectLoad]
    effect_surface_force_n: _containers.RepeatedScalarFieldContainer[float]
    effects_outside: _containers.RepeatedCompositeFieldContainer[EffectOutside]
    added_mass: _containers.RepeatedScalarFieldContainer[float]
    surface_couple_nm: _containers.RepeatedScalarFieldContainer[float]
    moment_uncertainty_nm: Vector3
    base: BaseAnswer
    jacobian: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, surface_force_n: _Optional[_Iterable[float]] = ..., surface_point_m: _Optional[_Iterable[float]] = ..., wetted_fraction: _Optional[_Iterable[float]] = ..., wrench: _Optional[_Union[Wrench, _Mapping]] = ..., uncertainty_n: _Optional[_Union[Vector3, _Mapping]] = ..., in_domain: bool = ..., outside: _Optional[_Iterable[_Union[Outside, _Mapping]]] = ..., bundle_version: _Optional[int] = ..., provenance: _Optional[str] = ..., compute_ns: _Optional[int] = ..., effects: _Optional[_Iterable[_Union[EffectLoad, _Mapping]]] = ..., effect_surface_force_n: _Optional[_Iterable[float]] = ..., effects_outside: _Optional[_Iterable[_Union[EffectOutside, _Mapping]]] = ..., added_mass: _Optional[_Iterable[float]] = ..., surface_couple_nm: _Optional[_Iterable[float]] = ..., moment_uncertainty_nm: _Optional[_Union[Vector3, _Mapping]] = ..., base: _Optional[_Union[BaseAnswer, _Mapping]] = ..., jacobian: _Optional[_Iterable[float]] = ...) -> None: ...

class EffectLoad(_message.Message):
    __slots__ = ("effect", "force_n", "moment_nm", "left_out")
    EFFECT_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MOMENT_NM_FIELD_NUMBER: _ClassVar[int]
    LEFT_OUT_FIELD_NUMBER: _ClassVar[int]
    effect: Effect
    force_n: Vector3
    moment_nm: Vector3
    left_out: LeftOut
    def __init__(self, effect: _Optional[_Union[Effect, str]] = ..., force_n: _Optional[_Union[Vector3, _Mapping]] = ..., moment_nm: _Optional[_Union[Vector3, _Mapping]] = ..., left_out: _Optional[_Union[LeftOut, str]] = ...) -> None: ...

class EffectOutside(_message.Message):
    __slots__ = ("quantity", "excess", "index")
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    EXCESS_FIELD_NUMBER: _ClassVar[int]
    INDEX_FIELD_NUMBER: _ClassVar[int]
    quantity: BoxQuantity
    excess: float
    index: int
    def __init__(self, quantity: _Optional[_Union[BoxQuantity, str]] = ..., excess: _Optional[float] = ..., index: _Optional[int] = ...) -> None: ...

class Wrench(_message.Message):
    __slots__ = ("force_n", "moment_nm", "about_m")
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MOMENT_NM_FIELD_NUMBER: _ClassVar[int]
    ABOUT_M_FIELD_NUMBER: _ClassVar[int]
    force_n: Vector3
    moment_nm: Vector3
    about_m: Vector3
    def __init__(self, force_n: _Optional[_Union[Vector3, _Mapping]] = ..., moment_nm: _Optional[_Union[Vector3, _Mapping]] = ..., about_m: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class Outside(_message.Message):
    __slots__ = ("quantity", "excess", "index")
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    EXCESS_FIELD_NUMBER: _ClassVar[int]
    INDEX_FIELD_NUMBER: _ClassVar[int]
    quantity: Quantity
    excess: float
    index: int
    def __init__(self, quantity: _Optional[_Union[Quantity, str]] = ..., excess: _Optional[float] = ..., index: _Optional[int] = ...) -> None: ...

class EvaluateBatchRequest(_message.Message):
    __slots__ = ("vehicle", "velocity_mps", "current_mps", "angular_velocity_radps", "acceleration_mps2", "angular_acceleration_radps2", "depth_m", "density_kgpm3", "gravity_direction", "ground_contact", "omit_surfaces", "heading_rad", "depth_rate_mps", "wheel_speed_radps", "implicit_added_mass", "water_level_m", "bed_clearance_m", "bed", "physics", "jacobian", "wave_vector_radpm", "wave_amplitude_m", "wave_phase_rad", "wheel_water_level_m", "current_exponent")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    CURRENT_MPS_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    ACCELERATION_MPS2_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_ACCELERATION_RADPS2_FIELD_NUMBER: _ClassVar[int]
    DEPTH_M_FIELD_NUMBER: _ClassVar[int]
    DENSITY_KGPM3_FIELD_NUMBER: _ClassVar[int]
    GRAVITY_DIRECTION_FIELD_NUMBER: _ClassVar[int]
    GROUND_CONTACT_FIELD_NUMBER: _ClassVar[int]
    OMIT_SURFACES_FIELD_NUMBER: _ClassVar[int]
    HEADING_RAD_FIELD_NUMBER: _ClassVar[int]
    DEPTH_RATE_MPS_FIELD_NUMBER: _ClassVar[int]
    WHEEL_SPEED_RADPS_FIELD_NUMBER: _ClassVar[int]
    IMPLICIT_ADDED_MASS_FIELD_NUMBER: _ClassVar[int]
    WATER_LEVEL_M_FIELD_NUMBER: _ClassVar[int]
    BED_CLEARANCE_M_FIELD_NUMBER: _ClassVar[int]
    BED_FIELD_NUMBER: _ClassVar[int]
    PHYSICS_FIELD_NUMBER: _ClassVar[int]
    JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    WAVE_VECTOR_RADPM_FIELD_NUMBER: _ClassVar[int]
    WAVE_AMPLITUDE_M_FIELD_NUMBER: _ClassVar[int]
    WAVE_PHASE_RAD_FIELD_NUMBER: _ClassVar[int]
    WHEEL_WATER_LEVEL_M_FIELD_NUMBER: _ClassVar[int]
    CURRENT_EXPONENT_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    velocity_mps: _containers.RepeatedScalarFieldContainer[float]
    current_mps: _containers.RepeatedScalarFieldContainer[float]
    angular_velocity_radps: _containers.RepeatedScalarFieldContainer[float]
    acceleration_mps2: _containers.RepeatedScalarFieldContainer[float]
    angular_acceleration_radps2: _containers.RepeatedScalarFieldContainer[float]
    depth_m: _containers.RepeatedScalarFieldContainer[float]
    density_kgpm3: _containers.RepeatedScalarFieldContainer[float]
    gravity_direction: _containers.RepeatedScalarFieldContainer[float]
    ground_contact: GroundContact
    omit_surfaces: bool
    heading_rad: _containers.RepeatedScalarFieldContainer[float]
    depth_rate_mps: _containers.RepeatedScalarFieldContainer[float]
    wheel_speed_radps: _containers.RepeatedScalarFieldContainer[float]
    implicit_added_mass: bool
    water_level_m: _containers.RepeatedScalarFieldContainer[float]
    bed_clearance_m: _containers.RepeatedScalarFieldContainer[float]
    bed: _containers.RepeatedScalarFieldContainer[float]
    physics: Physics
    jacobian: bool
    wave_vector_radpm: _containers.RepeatedScalarFieldContainer[float]
    wave_amplitude_m: _containers.RepeatedScalarFieldContainer[float]
    wave_phase_rad: _containers.RepeatedScalarFieldContainer[float]
    wheel_water_level_m: _containers.RepeatedScalarFieldContainer[float]
    current_exponent: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, vehicle: _Optional[str] = ..., velocity_mps: _Optional[_Iterable[float]] = ..., current_mps: _Optional[_Iterable[float]] = ..., angular_velocity_radps: _Optional[_Iterable[float]] = ..., acceleration_mps2: _Optional[_Iterable[float]] = ..., angular_acceleration_radps2: _Optional[_Iterable[float]] = ..., depth_m: _Optional[_Iterable[float]] = ..., density_kgpm3: _Optional[_Iterable[float]] = ..., gravity_direction: _Optional[_Iterable[float]] = ..., ground_contact: _Optional[_Union[GroundContact, str]] = ..., omit_surfaces: bool = ..., heading_rad: _Optional[_Iterable[float]] = ..., depth_rate_mps: _Optional[_Iterable[float]] = ..., wheel_speed_radps: _Optional[_Iterable[float]] = ..., implicit_added_mass: bool = ..., water_level_m: _Optional[_Iterable[float]] = ..., bed_clearance_m: _Optional[_Iterable[float]] = ..., bed: _Optional[_Iterable[float]] = ..., physics: _Optional[_Union[Physics, str]] = ..., jacobian: bool = ..., wave_vector_radpm: _Optional[_Iterable[float]] = ..., wave_amplitude_m: _Optional[_Iterable[float]] = ..., wave_phase_rad: _Optional[_Iterable[float]] = ..., wheel_water_level_m: _Optional[_Iterable[float]] = ..., current_exponent: _Optional[_Iterable[float]] = ...) -> None: ...

class EvaluateBatchResponse(_message.Message):
    __slots__ = ("surface_force_n", "surface_point_m", "wetted_fraction", "force_n", "moment_nm", "about_m", "uncertainty_n", "outside", "bundle_version", "provenance", "compute_ns", "effects", "effect_force_n", "effect_moment_nm", "effect_left_out", "effect_surface_force_n", "effects_outside", "added_mass", "surface_couple_nm", "moment_uncertainty_nm", "base", "jacobian")
    SURFACE_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    SURFACE_POINT_M_FIELD_NUMBER: _ClassVar[int]
    WETTED_FRACTION_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MOMENT_NM_FIELD_NUMBER: _ClassVar[int]
    ABOUT_M_FIELD_NUMBER: _ClassVar[int]
    UNCERTAINTY_N_FIELD_NUMBER: _ClassVar[int]
    OUTSIDE_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_VERSION_FIELD_NUMBER: _ClassVar[int]
    PROVENANCE_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_NS_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_FIELD_NUMBER: _ClassVar[int]
    EFFECT_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    EFFECT_MOMENT_NM_FIELD_NUMBER: _ClassVar[int]
    EFFECT_LEFT_OUT_FIELD_NUMBER: _ClassVar[int]
    EFFECT_SURFACE_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_OUTSIDE_FIELD_NUMBER: _ClassVar[int]
    ADDED_MASS_FIELD_NUMBER: _ClassVar[int]
    SURFACE_COUPLE_NM_FIELD_NUMBER: _ClassVar[int]
    MOMENT_UNCERTAINTY_NM_FIELD_NUMBER: _ClassVar[int]
    BASE_FIELD_NUMBER: _ClassVar[int]
    JACOBIAN_FIELD_NUMBER: _ClassVar[int]
    surface_force_n: _containers.RepeatedScalarFieldContainer[float]
    surface_point_m: _containers.RepeatedScalarFieldContainer[float]
    wetted_fraction: _containers.RepeatedScalarFieldContainer[float]
    force_n: _containers.RepeatedScalarFieldContainer[float]
    moment_nm: _containers.RepeatedScalarFieldContainer[float]
    about_m: Vector3
    uncertainty_n: _containers.RepeatedScalarFieldContainer[float]
    outside: _containers.RepeatedCompositeFieldContainer[Outside]
    bundle_version: int
    provenance: str
    compute_ns: int
    effects: _containers.RepeatedScalarFieldContainer[Effect]
    effect_force_n: _containers.RepeatedScalarFieldContainer[float]
    effect_moment_nm: _containers.RepeatedScalarFieldContainer[float]
    effect_left_out: _containers.RepeatedScalarFieldContainer[LeftOut]
    effect_surface_force_n: _containers.RepeatedScalarFieldContainer[float]
    effects_outside: _containers.RepeatedCompositeFieldContainer[EffectOutside]
    added_mass: _containers.RepeatedScalarFieldContainer[float]
    surface_couple_nm: _containers.RepeatedScalarFieldContainer[float]
    moment_uncertainty_nm: _containers.RepeatedScalarFieldContainer[float]
    base: _containers.RepeatedCompositeFieldContainer[BaseAnswer]
    jacobian: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, surface_force_n: _Optional[_Iterable[float]] = ..., surface_point_m: _Optional[_Iterable[float]] = ..., wetted_fraction: _Optional[_Iterable[float]] = ..., force_n: _Optional[_Iterable[float]] = ..., moment_nm: _Optional[_Iterable[float]] = ..., about_m: _Optional[_Union[Vector3, _Mapping]] = ..., uncertainty_n: _Optional[_Iterable[float]] = ..., outside: _Optional[_Iterable[_Union[Outside, _Mapping]]] = ..., bundle_version: _Optional[int] = ..., provenance: _Optional[str] = ..., compute_ns: _Optional[int] = ..., effects: _Optional[_Iterable[_Union[Effect, str]]] = ..., effect_force_n: _Optional[_Iterable[float]] = ..., effect_moment_nm: _Optional[_Iterable[float]] = ..., effect_left_out: _Optional[_Iterable[_Union[LeftOut, str]]] = ..., effect_surface_force_n: _Optional[_Iterable[float]] = ..., effects_outside: _Optional[_Iterable[_Union[EffectOutside, _Mapping]]] = ..., added_mass: _Optional[_Iterable[float]] = ..., surface_couple_nm: _Optional[_Iterable[float]] = ..., moment_uncertainty_nm: _Optional[_Iterable[float]] = ..., base: _Optional[_Iterable[_Union[BaseAnswer, _Mapping]]] = ..., jacobian: _Optional[_Iterable[float]] = ...) -> None: ...

class ListVehiclesRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListVehiclesResponse(_message.Message):
    __slots__ = ("vehicles",)
    VEHICLES_FIELD_NUMBER: _ClassVar[int]
    vehicles: _containers.RepeatedCompositeFieldContainer[VehicleSummary]
    def __init__(self, vehicles: _Optional[_Iterable[_Union[VehicleSummary, _Mapping]]] = ...) -> None: ...

class VehicleSummary(_message.Message):
    __slots__ = ("name", "bundle_version", "surface_count", "provenance", "origin", "base")
    NAME_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_VERSION_FIELD_NUMBER: _ClassVar[int]
    SURFACE_COUNT_FIELD_NUMBER: _ClassVar[int]
    PROVENANCE_FIELD_NUMBER: _ClassVar[int]
    ORIGIN_FIELD_NUMBER: _ClassVar[int]
    BASE_FIELD_NUMBER: _ClassVar[int]
    name: str
    bundle_version: int
    surface_count: int
    provenance: str
    origin: str
    base: str
    def __init__(self, name: _Optional[str] = ..., bundle_version: _Optional[int] = ..., surface_count: _Optional[int] = ..., provenance: _Optional[str] = ..., origin: _Optional[str] = ..., base: _Optional[str] = ...) -> None: ...

class GetVehicleRequest(_message.Message):
    __slots__ = ("vehicle", "include_mesh")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    INCLUDE_MESH_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    include_mesh: bool
    def __init__(self, vehicle: _Optional[str] = ..., include_mesh: bool = ...) -> None: ...

class GetVehicleResponse(_message.Message):
    __slots__ = ("summary", "length_m", "width_m", "height_m", "z0_m", "mass_kg", "center_of_mass_m", "inertia_kgm2", "surfaces", "domain", "mesh_stl", "face_surface", "effects", "effects_validity")
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    LENGTH_M_FIELD_NUMBER: _ClassVar[int]
    WIDTH_M_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    Z0_M_FIELD_NUMBER: _ClassVar[int]
    MASS_KG_FIELD_NUMBER: _ClassVar[int]
    CENTER_OF_MASS_M_FIELD_NUMBER: _ClassVar[int]
    INERTIA_KGM2_FIELD_NUMBER: _ClassVar[int]
    SURFACES_FIELD_NUMBER: _ClassVar[int]
    DOMAIN_FIELD_NUMBER: _ClassVar[int]
    MESH_STL_FIELD_NUMBER: _ClassVar[int]
    FACE_SURFACE_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_FIELD_NUMBER: _ClassVar[int]
    EFFECTS_VALIDITY_FIELD_NUMBER: _ClassVar[int]
    summary: VehicleSummary
    length_m: float
    width_m: float
    height_m: float
    z0_m: float
    mass_kg: float
    center_of_mass_m: Vector3
    inertia_kgm2: _containers.RepeatedScalarFieldContainer[float]
    surfaces: _containers.RepeatedCompositeFieldContainer[Surface]
    domain: _containers.RepeatedCompositeFieldContainer[Range]
    mesh_stl: bytes
    face_surface: _containers.RepeatedScalarFieldContainer[int]
    effects: _containers.RepeatedCompositeFieldContainer[ActiveEffect]
    effects_validity: _containers.RepeatedCompositeFieldContainer[BoxRange]
    def __init__(self, summary: _Optional[_Union[VehicleSummary, _Mapping]] = ..., length_m: _Optional[float] = ..., width_m: _Optional[float] = ..., height_m: _Optional[float] = ..., z0_m: _Optional[float] = ..., mass_kg: _Optional[float] = ..., center_of_mass_m: _Optional[_Union[Vector3, _Mapping]] = ..., inertia_kgm2: _Optional[_Iterable[float]] = ..., surfaces: _Optional[_Iterable[_Union[Surface, _Mapping]]] = ..., domain: _Optional[_Iterable[_Union[Range, _Mapping]]] = ..., mesh_stl: _Optional[bytes] = ..., face_surface: _Optional[_Iterable[int]] = ..., effects: _Optional[_Iterable[_Union[ActiveEffect, _Mapping]]] = ..., effects_validity: _Optional[_Iterable[_Union[BoxRange, _Mapping]]] = ...) -> None: ...

class ActiveEffect(_message.Message):
    __slots__ = ("effect", "name", "equation", "parameters", "provisional", "region")
    EFFECT_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    EQUATION_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    PROVISIONAL_FIELD_NUMBER: _ClassVar[int]
    REGION_FIELD_NUMBER: _ClassVar[int]
    effect: Effect
    name: str
    equation: str
    parameters: _containers.RepeatedCompositeFieldContainer[EffectParameter]
    provisional: bool
    region: _containers.RepeatedCompositeFieldContainer[RegionLimit]
    def __init__(self, effect: _Optional[_Union[Effect, str]] = ..., name: _Optional[str] = ..., equation: _Optional[str] = ..., parameters: _Optional[_Iterable[_Union[EffectParameter, _Mapping]]] = ..., provisional: bool = ..., region: _Optional[_Iterable[_Union[RegionLimit, _Mapping]]] = ...) -> None: ...

class RegionLimit(_message.Message):
    __slots__ = ("quantity", "unit", "above", "at_most")
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    ABOVE_FIELD_NUMBER: _ClassVar[int]
    AT_MOST_FIELD_NUMBER: _ClassVar[int]
    quantity: str
    unit: str
    above: _containers.RepeatedScalarFieldContainer[float]
    at_most: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, quantity: _Optional[str] = ..., unit: _Optional[str] = ..., above: _Optional[_Iterable[float]] = ..., at_most: _Optional[_Iterable[float]] = ...) -> None: ...

class EffectParameter(_message.Message):
    __slots__ = ("name", "value", "std", "unit")
    NAME_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    STD_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    name: str
    value: float
    std: float
    unit: str
    def __init__(self, name: _Optional[str] = ..., value: _Optional[float] = ..., std: _Optional[float] = ..., unit: _Optional[str] = ...) -> None: ...

class BoxRange(_message.Message):
    __slots__ = ("quantity", "minimum", "maximum")
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    MINIMUM_FIELD_NUMBER: _ClassVar[int]
    MAXIMUM_FIELD_NUMBER: _ClassVar[int]
    quantity: BoxQuantity
    minimum: float
    maximum: float
    def __init__(self, quantity: _Optional[_Union[BoxQuantity, str]] = ..., minimum: _Optional[float] = ..., maximum: _Optional[float] = ...) -> None: ...

class Surface(_message.Message):
    __slots__ = ("name", "kind", "centroid_m", "normal", "area_m2")
    NAME_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    CENTROID_M_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    AREA_M2_FIELD_NUMBER: _ClassVar[int]
    name: str
    kind: str
    centroid_m: Vector3
    normal: Vector3
    area_m2: float
    def __init__(self, name: _Optional[str] = ..., kind: _Optional[str] = ..., centroid_m: _Optional[_Union[Vector3, _Mapping]] = ..., normal: _Optional[_Union[Vector3, _Mapping]] = ..., area_m2: _Optional[float] = ...) -> None: ...

class Range(_message.Message):
    __slots__ = ("quantity", "minimum", "maximum")
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    MINIMUM_FIELD_NUMBER: _ClassVar[int]
    MAXIMUM_FIELD_NUMBER: _ClassVar[int]
    quantity: Quantity
    minimum: float
    maximum: float
    def __init__(self, quantity: _Optional[_Union[Quantity, str]] = ..., minimum: _Optional[float] = ..., maximum: _Optional[float] = ...) -> None: ...

class GetLatencyRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class GetLatencyResponse(_message.Message):
    __slots__ = ("latencies", "window_s")
    LATENCIES_FIELD_NUMBER: _ClassVar[int]
    WINDOW_S_FIELD_NUMBER: _ClassVar[int]
    latencies: _containers.RepeatedCompositeFieldContainer[Latency]
    window_s: float
    def __init__(self, latencies: _Optional[_Iterable[_Union[Latency, _Mapping]]] = ..., window_s: _Optional[float] = ...) -> None: ...

class Latency(_message.Message):
    __slots__ = ("transport", "vehicle", "since_start", "window")
    TRANSPORT_FIELD_NUMBER: _ClassVar[int]
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    SINCE_START_FIELD_NUMBER: _ClassVar[int]
    WINDOW_FIELD_NUMBER: _ClassVar[int]
    transport: str
    vehicle: str
    since_start: Percentiles
    window: Percentiles
    def __init__(self, transport: _Optional[str] = ..., vehicle: _Optional[str] = ..., since_start: _Optional[_Union[Percentiles, _Mapping]] = ..., window: _Optional[_Union[Percentiles, _Mapping]] = ...) -> None: ...

class Percentiles(_message.Message):
    __slots__ = ("count", "p50_us", "p95_us", "p99_us", "p99_9_us", "max_us")
    COUNT_FIELD_NUMBER: _ClassVar[int]
    P50_US_FIELD_NUMBER: _ClassVar[int]
    P95_US_FIELD_NUMBER: _ClassVar[int]
    P99_US_FIELD_NUMBER: _ClassVar[int]
    P99_9_US_FIELD_NUMBER: _ClassVar[int]
    MAX_US_FIELD_NUMBER: _ClassVar[int]
    count: int
    p50_us: float
    p95_us: float
    p99_us: float
    p99_9_us: float
    max_us: float
    def __init__(self, count: _Optional[int] = ..., p50_us: _Optional[float] = ..., p95_us: _Optional[float] = ..., p99_us: _Optional[float] = ..., p99_9_us: _Optional[float] = ..., max_us: _Optional[float] = ...) -> None: ...

class GetStabilityRequest(_message.Message):
    __slots__ = ("vehicle", "depth_m", "speed_mps", "heading_rad", "friction_min", "friction_max", "density_kgpm3", "roll_pitch", "ground_contact", "bed", "normal_forces")
    VEHICLE_FIELD_NUMBER: _ClassVar[int]
    DEPTH_M_FIELD_NUMBER: _ClassVar[int]
    SPEED_MPS_FIELD_NUMBER: _ClassVar[int]
    HEADING_RAD_FIELD_NUMBER: _ClassVar[int]
    FRICTION_MIN_FIELD_NUMBER: _ClassVar[int]
    FRICTION_MAX_FIELD_NUMBER: _ClassVar[int]
    DENSITY_KGPM3_FIELD_NUMBER: _ClassVar[int]
    ROLL_PITCH_FIELD_NUMBER: _ClassVar[int]
    GROUND_CONTACT_FIELD_NUMBER: _ClassVar[int]
    BED_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FORCES_FIELD_NUMBER: _ClassVar[int]
    vehicle: str
    depth_m: _containers.RepeatedScalarFieldContainer[float]
    speed_mps: _containers.RepeatedScalarFieldContainer[float]
    heading_rad: float
    friction_min: float
    friction_max: float
    density_kgpm3: float
    roll_pitch: RollPitch
    ground_contact: GroundContact
    bed: float
    normal_forces: bool
    def __init__(self, vehicle: _Optional[str] = ..., depth_m: _Optional[_Iterable[float]] = ..., speed_mps: _Optional[_Iterable[float]] = ..., heading_rad: _Optional[float] = ..., friction_min: _Optional[float] = ..., friction_max: _Optional[float] = ..., density_kgpm3: _Optional[float] = ..., roll_pitch: _Optional[_Union[RollPitch, _Mapping]] = ..., ground_contact: _Optional[_Union[GroundContact, str]] = ..., bed: _Optional[float] = ..., normal_forces: bool = ...) -> None: ...

class StabilityModes(_message.Message):
    __slots__ = ("floats", "slides", "topples", "steers")
    FLOATS_FIELD_NUMBER: _ClassVar[int]
    SLIDES_FIELD_NUMBER: _ClassVar[int]
    TOPPLES_FIELD_NUMBER: _ClassVar[int]
    STEERS_FIELD_NUMBER: _ClassVar[int]
    floats: _containers.RepeatedScalarFieldContainer[float]
    slides: _containers.RepeatedScalarFieldContainer[float]
    topples: _containers.RepeatedScalarFieldContainer[float]
    steers: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, floats: _Optional[_Iterable[float]] = ..., slides: _Optional[_Iterable[float]] = ..., topples: _Optional[_Iterable[float]] = ..., steers: _Optional[_Iterable[float]] = ...) -> None: ...

class GetStabilityResponse(_message.Message):
    __slots__ = ("probability", "margin", "friction_needed", "normal_force_n", "feet", "in_domain", "friction_min", "friction_max", "bundle_version", "provenance", "compute_ns")
    PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    MARGIN_FIELD_NUMBER: _ClassVar[int]
    FRICTION_NEEDED_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    FEET_FIELD_NUMBER: _ClassVar[int]
    IN_DOMAIN_FIELD_NUMBER: _ClassVar[int]
    FRICTION_MIN_FIELD_NUMBER: _ClassVar[int]
    FRICTION_MAX_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_VERSION_FIELD_NUMBER: _ClassVar[int]
    PROVENANCE_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_NS_FIELD_NUMBER: _ClassVar[int]
    probability: StabilityModes
    margin: StabilityModes
    friction_needed: _containers.RepeatedScalarFieldContainer[float]
    normal_force_n: _containers.RepeatedScalarFieldContainer[float]
    feet: _containers.RepeatedCompositeFieldContainer[Foot]
    in_domain: _containers.RepeatedScalarFieldContainer[bool]
    friction_min: float
    friction_max: float
    bundle_version: int
    provenance: str
    compute_ns: int
    def __init__(self, probability: _Optional[_Union[StabilityModes, _Mapping]] = ..., margin: _Optional[_Union[StabilityModes, _Mapping]] = ..., friction_needed: _Optional[_Iterable[float]] = ..., normal_force_n: _Optional[_Iterable[float]] = ..., feet: _Optional[_Iterable[_Union[Foot, _Mapping]]] = ..., in_domain: _Optional[_Iterable[bool]] = ..., friction_min: _Optional[float] = ..., friction_max: _Optional[float] = ..., bundle_version: _Optional[int] = ..., provenance: _Optional[str] = ..., compute_ns: _Optional[int] = ...) -> None: ...

class Foot(_message.Message):
    __slots__ = ("surface", "x_m", "y_m")
    SURFACE_FIELD_NUMBER: _ClassVar[int]
    X_M_FIELD_NUMBER: _ClassVar[int]
    Y_M_FIELD_NUMBER: _ClassVar[int]
    surface: str
    x_m: float
    y_m: float
    def __init__(self, surface: _Optional[str] = ..., x_m: _Optional[float] = ..., y_m: _Optional[float] = ...) -> None: ...
