"""What a hello can say, once for all clients that build it from types: docs/reference/protocol-hello.md,
protocol-contact.md, protocol-effects.md and indenters.md as data.

A `kind` is one of: number, whole, flag, text, pair, wholes (two of them), triple, vertices, triangles, numbers,
point; `list NAME`; or the name of an enumeration or a structure. A default of None: the member is left out unless it
is set.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Enumeration:
    name: str
    doc: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class Member:
    name: str
    kind: str
    default: object
    doc: str
    wire: str = ""

    @property
    def key(self) -> str:
        """Its name on the wire."""
        return self.wire or self.name

    @property
    def item(self) -> str:
        """What a list holds."""
        return self.kind.removeprefix("list ") if self.kind.startswith("list ") else ""


@dataclass(frozen=True)
class Structure:
    name: str
    doc: str
    members: tuple[Member, ...] = ()
    #: Shapes and effects: their name on the wire.
    tag: str = ""
    #: `Shape` or `Effect`, or neither.
    base: str = ""
    #: Members of this structure that stand on the wire among those around it.
    flat: tuple[str, ...] = field(default=())


ENUMERATIONS = (
    Enumeration("FrameInput", "What the frames of a session hold.", ("pressure", "objects", "gaps")),
    Enumeration("SampleLayout", "The places of samples: the pixels of the map, or the vertices of the atlas.", ("map", "vertices")),
    Enumeration(
        "OutOfRangeRule",
        "What happens to pressure beyond the training of the tier: it is reduced, or sent on and flagged, or the frame is refused.",
        ("clamp", "flag", "refuse"),
    ),
    Enumeration(
        "ContactMethod",
        "How the service finds the pressure from objects or gaps, from accurate to fast.",
        ("pixels", "coarse_pixels", "second_order", "small_strain", "springs"),
    ),
    Enumeration("ActuatorInput", "What drives the actuators: SED (J/m3), or firing rates (Hz).", ("sed", "sa1_rate")),
    Enumeration(
        "ActuatorDrive",
        "How intensities are computed: each actuator by itself, or all pins fitted together, or that and corrected once by the network.",
        ("formula", "fitted", "corrected"),
    ),
    Enumeration("UnitClass", "Class of a simulated nerve fibre: slowly adapting, rapidly adapting, Pacinian.", ("sa1", "ra", "pc")),
    Enumeration("Tissue", "Tissue whose measured creep is used.", ("subcutaneous", "skin")),
    Enumeration(
        "Moduli",
        "Which stiffness the training of the tier had: that right after a step, or that after a long time.",
        ("instantaneous", "long_term"),
    ),
)

SHAPES = (
    Structure(
        "PlateShape",
        "A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle.",
        (
            Member("size_mm", "pair", (20.0, 20.0), "Side lengths along x and y, mm."),
            Member("edge_radius_mm", "number", 1.0, "Radius of its edges, mm: 0 to half the shorter side."),
        ),
        "plate",
        "Shape",
    ),
    Structure(
        "SphereShape",
        "A ball. Its origin is its centre.",
        (Member("radius_mm", "number", 5.0, "Radius, mm."),),
        "sphere",
        "Shape",
    ),
    Structure(
        "CylinderShape",
        "A bar that lies along its y, with rounded ends. Its origin is the middle of its axis.",
        (
            Member("radius_mm", "number", 3.0, "Radius, mm."),
            Member("length_mm", "number", 30.0, "Length with its rounded ends, mm."),
            Member("end_radius_mm", "number", 1.0, "Rounds the ends, mm: at most the radius; equal to it they are half spheres."),
        ),
        "cylinder",
        "Shape",
    ),
    Structure(
        "WedgeShape",
        "A blunt wedge along its y. Its origin is the middle of its tip.",
        (
            Member("tip_width_mm", "number", 0.05, "Width at the tip, mm, before its edges are rounded."),
            Member("base_width_mm", "number", 1.0, "Width at the base, mm, before its edges are rounded: at least that at the tip."),
            Member("height_mm", "number", 2.0, "Height, mm."),
            Member("tip_radius_mm", "number", 0.02, "Radius of all edges, mm."),
            Member("length_mm", "number", 30.0, "Length along y, mm."),
        ),
        "wedge",
        "Shape",
    ),
    Structure(
        "PunchShape",
        "An upright cylinder with a flat end. Its origin is the middle of that end.",
        (
            Member("radius_mm", "number", 3.0, "Outer radius, mm."),
            Member("rim_radius_mm", "number", 0.25, "Rounds the rim, mm: at most the radius and half the height."),
            Member("height_mm", "number", 6.0, "Height, mm."),
        ),
        "punch",
        "Shape",
    ),
    Structure(
        "RingShape",
        "The end of an upright tube. Its origin is the middle of that end.",
        (
            Member("outer_radius_mm", "number", 4.0, "Outer radius, mm."),
            Member("inner_radius_mm", "number", 3.0, "Radius of the hole, mm: below the outer radius."),
            Member("rim_radius_mm", "number", 0.25, "Rounds all four rims, mm: at most half the wall and half the height."),
            Member("height_mm", "number", 6.0, "Height, mm."),
        ),
        "ring",
        "Shape",
    ),
    Structure(
        "BoxShape",
        "A box with rounded edges. Its origin is its middle.",
        (
            Member("size_mm", "triple", (10.0, 10.0, 10.0), "Side lengths along x, y and z, mm."),
            Member("edge_radius_mm", "number", 1.0, "Radius of its edges, mm: above 0, at most half the shortest side."),
        ),
        "box",
        "Shape",
    ),
    Structure(
        "CapsuleShape",
        "A bar that lies along its y and ends in half balls. Its origin is its middle.",
        (
            Member("radius_mm", "number", 3.0, "Radius, mm."),
            Member("length_mm", "number", 20.0, "Length with both half balls, mm: at least twice the radius."),
        ),
        "capsule",
        "Shape",
    ),
    Structure(
        "TorusShape",
        "A ring of round section that lies flat, its hole along its z. Its origin is its middle.",
        (
            Member("radius_mm", "number", 4.0, "Radius of the circle in the middle of the tube, mm."),
            Member("tube_radius_mm", "number", 1.0, "Radius of the tube, mm: below that of the circle."),
        ),
        "torus",
        "Shape",
    ),
    Structure(
        "GratingShape",
        "Ridges along y on a base. Its origin lies in the plane of their tops, in the middle.",
        (
            Member("ridges", "whole", 5, "Number of ridges: 1 to 1000."),
            Member("ridge_mm", "number", 1.5, "Width of a ridge, mm."),
            Member("groove_mm", "number", 1.5, "Width of a groove, mm."),
            Member("height_mm", "number", 1.5, "Depth of the grooves, mm."),
            Member("edge_radius_mm", "number", 0.25, "Radius of all edges, mm: at most half a ridge, half the length and 2 mm."),
            Member("length_mm", "number", 20.0, "Length along y, mm."),
        ),
        "grating",
        "Shape",
    ),
    Structure(
        "DotsShape",
        "Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle.",
        (
            Member("count", "wholes", (3, 2), "Dots along x and y: 1 to 1000 each."),
            Member("pitch_mm", "number", 2.34, "Distance of neighbours, mm: at least the width of a dot."),
            Member("base_mm", "number", 1.44, "Width of a dot where it meets the plate, mm."),
            Member("height_mm", "number", 0.48, "Height of a dot, mm: at most half its width."),
            Member("plate_mm", "pair", (20.0, 20.0), "Side lengths of the plate, mm; it has to hold the dots and 1 mm around them."),
        ),
        "dots",
        "Shape",
    ),
    Structure(
        "HeightmapShape",
        "A surface of listed heights. Its origin is the middle of the grid.",
        (
            Member("columns", "whole", 2, "Number of heights along x: 2 or more."),
            Member("pixel_mm", "pair", (0.1, 0.1), "Distance between neighbouring heights along x and y, mm."),
            Member("heights_mm", "numbers", (), "Heights above the origin, mm, row by row from the lowest y; two rows or more."),
        ),
        "heightmap",
        "Shape",
    ),
    Structure(
        "MeshShape",
        "A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so.",
        (
            Member("vertices_mm", "vertices", (), "x, y, z of each vertex, mm."),
            Member("triangles", "triangles", (), "Three vertices for each triangle, counter-clockwise as seen from outside."),
        ),
        "mesh",
        "Shape",
    ),
    Structure(
        "UnionShape",
        "Parts that move as one body.",
        (Member("parts", "list UnionPart", (), "The parts, 1 to 64."),),
        "union",
        "Shape",
    ),
)

PART = Structure(
    "UnionPart",
    "A part of a union, moved and turned in the union's axes.",
    (
        Member("part", "Shape", None, "What it is: any shape but a union."),
        Member("at_mm", "triple", (0.0, 0.0, 0.0), "Where its own origin lies, mm."),
        Member("yaw_deg", "number", 0.0, "Turn about the union's z, degrees: the first of the three."),
        Member("pitch_deg", "number", 0.0, "Turn about the union's y, degrees. A height map has to leave it 0."),
        Member("roll_deg", "number", 0.0, "Turn about the union's x, degrees. A height map has to leave it 0."),
    ),
)

CONTACT = (
    Structure(
        "TouchMaterial",
        "What an object is made of, as far as the skin feels it.",
        (
            Member("stiffness_mpa_per_mm", "number", None, "The pressure that pushes its surface in by 1 mm, MPa/mm: above 0. Left out: it is rigid."),
            Member("friction", "number", 0.0, "Coulomb's coefficient of friction with the skin: 0 to 10."),
        ),
    ),
    Structure(
        "TouchObject",
        "An object that can be touched; each frame gives its pose.",
        (
            Member("shape", "Shape", None, "Its shape, and its size in millimetres."),
            Member("material", "TouchMaterial", None, "What it is made of; by default rigid and without friction."),
        ),
        flat=("material",),
    ),
    Structure(
        "TouchFinger",
        "A finger of the session.",
        (
            Member("name", "text", None, "Which of the service's fingers it is, as GET /v1/fingers lists them. Left out: the default finger."),
            Member("width", "number", 1.0, "Its width divided by that of the finger of this name: 0.25 to 4."),
            Member("stiffness", "number", 1.0, "Stiffness of its tissue divided by that of the finger of this name: 0.25 to 4."),
        ),
    ),
)

PARAMETERS = (
    Structure(
        "Actuator",
        "An actuator of a tactile display.",
        (
            Member("at", "point", None, "Its place on the finger."),
            Member("radius_mm", "number", None, "Radius of what it averages over, or of its pin, mm. Left out: that of the effect."),
            Member("gain", "number", None, "Intensity for each unit of the input above the threshold. Left out: that of the effect."),
            Member("threshold", "number", None, "Input below which the intensity is 0. Left out: that of the effect."),
        ),
    ),
    Structure(
        "NerveUnit",
        "A simulated nerve fibre.",
        (
            Member("unit_class", "UnitClass", "sa1", "Its class.", wire="class"),
            Member("at", "point", None, "Its place on the finger."),
            Member("model", "whole", 0, "Which of TouchSim's neurons of the class: 0 to 3, for ra 0 to 8."),
        ),
    ),
    Structure(
        "PronyTerm",
        "A term of a Prony series.",
        (
            Member("g", "number", 0.0, "Share of the modulus that relaxes: above 0; all together at most 0.99."),
            Member("tau_s", "number", 1.0, "Its time constant, s."),
        ),
    ),
)

EFFECTS = (
    Structure("SummaryEffect", "Answers carry a summary: force, contact area and fourteen other numbers.", (), "summary", "Effect"),
    Structure(
        "PointsEffect",
        "Answers carry SED at points of the finger.",
        (Member("points", "list point", (), "The points, 1 to 1024."),),
        "points",
        "Effect",
    ),
    Structure(
        "AfferentsEffect",
        "Answers carry firing rates of slowly adapting nerve fibres, Hz.",
        (
            Member("e_ref_kpa", "number", 80.0, "Elastic modulus of the dermis, kPa."),
            Member("theta_kpa", "number", 8.0, "Threshold, kPa."),
            Member("k_s_hz_per_kpa", "number", 1.0, "Static sensitivity, Hz/kPa."),
            Member("k_d_hz_s_per_kpa", "number", 0.2, "Dynamic sensitivity, Hz s/kPa."),
            Member("map", "flag", True, "False: no map of rates; points, summary and actuators still use them."),
        ),
        "afferents",
        "Effect",
    ),
    Structure(
        "SpikesEffect",
        "Answers carry when simulated nerve fibres fired.",
        (
            Member("seed", "whole", 1, "Seed of the random places, of the models of units and of the noise."),
            Member("sa1_per_cm2", "number", 70.0, "Slowly adapting units for each cm2."),
            Member("ra_per_cm2", "number", 140.0, "Rapidly adapting units for each cm2."),
            Member("pc_per_cm2", "number", 21.0, "Pacinian units for each cm2."),
            Member("units", "list NerveUnit", None, "Units of your own in place of those at random, 1 to 4096."),
            Member("e_ref_kpa", "number", 80.0, "Elastic modulus of the dermis, kPa."),
            Member("noise", "flag", False, "Whether noise is added to the membranes."),
            Member("spikes_max", "whole", 1024, "Most spikes in one answer: 1 to 16384."),
        ),
        "spikes",
        "Effect",
    ),
    Structure(
        "ActuatorsEffect",
        "Answers carry an intensity for each actuator of a tactile display.",
        (
            Member("actuators", "list Actuator", (), "The actuators, 1 to 1024."),
            Member("radius_mm", "number", None, "Radius of what an actuator averages over, or of its pin, mm, where it has none of its own."),
            Member("gain", "number", None, "Intensity for each unit of the input above the threshold, where an actuator has none of its own."),
            Member("threshold", "number", 0.0, "Input below which the intensity is 0, in its unit."),
            Member("max", "number", 1.0, "Greatest intensity."),
            Member("input", "ActuatorInput", "sed", "What drives them; firing rates need the effect afferents."),
            Member("drive", "ActuatorDrive", "formula", "How intensities are computed."),
        ),
        "actuators",
        "Effect",
    ),
    Structure(
        "RelaxationEffect",
        "The tissue creeps under a constant pressure.",
        (
            Member("tissue", "Tissue", "subcutaneous", "Whose creep it is."),
            Member("prony", "list PronyTerm", None, "A series of your own in place of the tissue's, one to six terms."),
            Member("moduli", "Moduli", "instantaneous", "Which stiffness the training had."),
        ),
        "relaxation",
        "Effect",
    ),
    Structure("ShearEnergyEffect", "SED takes account of traction along the skin; needs friction.", (), "shear_energy", "Effect"),
    Structure(
        "ContactWindowEffect",
        "The map is cut to the region in contact.",
        (Member("margin_px", "whole", 24, "Margin around it, pixels."),),
        "contact_window",
        "Effect",
    ),
)

#: Members that have their default are not said.
HELLO = Structure(
    "Hello",
    "What a session asks for.",
    (
        Member("input", "FrameInput", None, "What frames hold. Left out: objects if there are any in the hello, pressure if not."),
        Member("input_layout", "SampleLayout", "map", "Places of the samples of pressure or gaps."),
        Member("sample_type", "SampleType", "f32", "Type of the samples of frames. Poses are f32; gaps are f32 or f16."),
        Member("pressure_scale_pa", "number", None, "Pressure that one unit of a u16 or u8 sample stands for, Pa."),
        Member("out_of_range", "OutOfRangeRule", "clamp", "What happens to pressure beyond the training."),
        Member("traction", "flag", False, "Frames of pressure at vertices also hold the traction."),
        Member("objects", "list TouchObject", (), "The objects, 1 to 16, whose poses frames hold."),
        Member("fingers", "list TouchFinger", (), "The fingers, 1 to 10. None: the default finger alone."),
        Member("force_target", "flag", False, "Each frame holds a net force with which the objects are to press."),
        Member("friction", "number", None, "Coulomb's coefficient of friction of what gaps tell of: 0 to 10. Left out: none."),
        Member("velocity", "flag", False, "Frames of gaps also hold velocities, mm/s."),
        Member("stale_after_us", "whole", None, "A frame that was delayed for longer on its way is stale, us. Left out: none is."),
        Member("map", "flag", True, "False: answers carry no SED at pixels or vertices."),
        Member("answer_layout", "SampleLayout", "map", "Places of the SED in answers."),
        Member("answer_sample_type", "SampleType", None, "Type of SED and firing rates in answers. Left out: that of frames."),
        Member("pressure", "SampleLayout", None, "Answers to objects and gaps carry the pressure that was found, Pa, at these places."),
        Member("shear", "flag", False, "Answers to objects and gaps carry the traction along the skin, Pa, at the vertices."),
        Member("displacement", "flag", False, "Answers to objects and gaps carry how far the skin has moved, mm, at the vertices."),
        Member("error_estimate", "flag", False, "Answers say how wrong they are likely to be."),
        Member("stiffness", "flag", False, "Answers to objects and gaps carry the local stiffness, N/mm."),
        Member("effects", "list Effect", (), "What is computed beside the map; nothing else is."),
        Member("contact_pa", "number", 0.0, "Pressure above which a pixel counts as in contact, Pa."),
        Member("tier", "text", None, "A tier by its name. Left out: the service chooses, by the budget if there is one."),
        Member("budget_us", "whole", None, "Time that a frame may spend in the service, us. Left out: no deadline."),
        Member("method", "ContactMethod", None, "How contact is solved. Left out: the most accurate method that can serve the hello."),
        Member("atlas_hash", "text", None, "Hash of the atlas that you draw with; the hello is refused if the tier has another."),
    ),
)

SAMPLE_TYPE = Enumeration("SampleType", "", ("f32", "f16", "u16", "u8"))
#: In an order in which each uses only what stands before it, but for parts of a union.
STRUCTURES = (*SHAPES, PART, *CONTACT, *PARAMETERS, *EFFECTS)
