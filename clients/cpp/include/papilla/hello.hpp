// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
// What a session asks for, as types; hello_text.hpp says them on the wire.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hello_text.hpp"
#include "wire.hpp"

namespace papilla {

/// What the frames of a session hold.
enum class FrameInput { pressure, objects, gaps };
constexpr std::array<const char*, 3> words_of(FrameInput) { return {"pressure", "objects", "gaps"}; }

/// The places of samples: the pixels of the map, or the vertices of the atlas.
enum class SampleLayout { map, vertices };
constexpr std::array<const char*, 2> words_of(SampleLayout) { return {"map", "vertices"}; }

/// What happens to pressure beyond the training of the tier: it is reduced, or sent on and flagged, or the frame is refused.
enum class OutOfRangeRule { clamp, flag, refuse };
constexpr std::array<const char*, 3> words_of(OutOfRangeRule) { return {"clamp", "flag", "refuse"}; }

/// How the service finds the pressure from objects or gaps, from accurate to fast.
enum class ContactMethod { pixels, coarse_pixels, second_order, small_strain, springs };
constexpr std::array<const char*, 5> words_of(ContactMethod) { return {"pixels", "coarse_pixels", "second_order", "small_strain", "springs"}; }

/// What drives the actuators: SED (J/m3), or firing rates (Hz).
enum class ActuatorInput { sed, sa1_rate };
constexpr std::array<const char*, 2> words_of(ActuatorInput) { return {"sed", "sa1_rate"}; }

/// How intensities are computed: each actuator by itself, or all pins fitted together, or that and corrected once by the network.
enum class ActuatorDrive { formula, fitted, corrected };
constexpr std::array<const char*, 3> words_of(ActuatorDrive) { return {"formula", "fitted", "corrected"}; }

/// Class of a simulated nerve fibre: slowly adapting, rapidly adapting, Pacinian.
enum class UnitClass { sa1, ra, pc };
constexpr std::array<const char*, 3> words_of(UnitClass) { return {"sa1", "ra", "pc"}; }

/// Tissue whose measured creep is used.
enum class Tissue { subcutaneous, skin };
constexpr std::array<const char*, 2> words_of(Tissue) { return {"subcutaneous", "skin"}; }

/// Which stiffness the training of the tier had: that right after a step, or that after a long time.
enum class Moduli { instantaneous, long_term };
constexpr std::array<const char*, 2> words_of(Moduli) { return {"instantaneous", "long_term"}; }

/// A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle.
struct PlateShape {
  /// Side lengths along x and y, mm.
  std::array<double, 2> size_mm{20.0, 20.0};
  /// Radius of its edges, mm: 0 to half the shorter side.
  double edge_radius_mm = 1.0;
  static constexpr const char* name = "plate";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("size_mm", self.size_mm);
    out("edge_radius_mm", self.edge_radius_mm);
  }
};

/// A ball. Its origin is its centre.
struct SphereShape {
  /// Radius, mm.
  double radius_mm = 5.0;
  static constexpr const char* name = "sphere";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("radius_mm", self.radius_mm);
  }
};

/// A bar that lies along its y, with rounded ends. Its origin is the middle of its axis.
struct CylinderShape {
  /// Radius, mm.
  double radius_mm = 3.0;
  /// Length with its rounded ends, mm.
  double length_mm = 30.0;
  /// Rounds the ends, mm: at most the radius; equal to it they are half spheres.
  double end_radius_mm = 1.0;
  static constexpr const char* name = "cylinder";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("radius_mm", self.radius_mm);
    out("length_mm", self.length_mm);
    out("end_radius_mm", self.end_radius_mm);
  }
};

/// A blunt wedge along its y. Its origin is the middle of its tip.
struct WedgeShape {
  /// Width at the tip, mm, before its edges are rounded.
  double tip_width_mm = 0.05;
  /// Width at the base, mm, before its edges are rounded: at least that at the tip.
  double base_width_mm = 1.0;
  /// Height, mm.
  double height_mm = 2.0;
  /// Radius of all edges, mm.
  double tip_radius_mm = 0.02;
  /// Length along y, mm.
  double length_mm = 30.0;
  static constexpr const char* name = "wedge";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("tip_width_mm", self.tip_width_mm);
    out("base_width_mm", self.base_width_mm);
    out("height_mm", self.height_mm);
    out("tip_radius_mm", self.tip_radius_mm);
    out("length_mm", self.length_mm);
  }
};

/// An upright cylinder with a flat end. Its origin is the middle of that end.
struct PunchShape {
  /// Outer radius, mm.
  double radius_mm = 3.0;
  /// Rounds the rim, mm: at most the radius and half the height.
  double rim_radius_mm = 0.25;
  /// Height, mm.
  double height_mm = 6.0;
  static constexpr const char* name = "punch";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("radius_mm", self.radius_mm);
    out("rim_radius_mm", self.rim_radius_mm);
    out("height_mm", self.height_mm);
  }
};

/// The end of an upright tube. Its origin is the middle of that end.
struct RingShape {
  /// Outer radius, mm.
  double outer_radius_mm = 4.0;
  /// Radius of the hole, mm: below the outer radius.
  double inner_radius_mm = 3.0;
  /// Rounds all four rims, mm: at most half the wall and half the height.
  double rim_radius_mm = 0.25;
  /// Height, mm.
  double height_mm = 6.0;
  static constexpr const char* name = "ring";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("outer_radius_mm", self.outer_radius_mm);
    out("inner_radius_mm", self.inner_radius_mm);
    out("rim_radius_mm", self.rim_radius_mm);
    out("height_mm", self.height_mm);
  }
};

/// A box with rounded edges. Its origin is its middle.
struct BoxShape {
  /// Side lengths along x, y and z, mm.
  std::array<double, 3> size_mm{10.0, 10.0, 10.0};
  /// Radius of its edges, mm: above 0, at most half the shortest side.
  double edge_radius_mm = 1.0;
  static constexpr const char* name = "box";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("size_mm", self.size_mm);
    out("edge_radius_mm", self.edge_radius_mm);
  }
};

/// A bar that lies along its y and ends in half balls. Its origin is its middle.
struct CapsuleShape {
  /// Radius, mm.
  double radius_mm = 3.0;
  /// Length with both half balls, mm: at least twice the radius.
  double length_mm = 20.0;
  static constexpr const char* name = "capsule";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("radius_mm", self.radius_mm);
    out("length_mm", self.length_mm);
  }
};

/// A ring of round section that lies flat, its hole along its z. Its origin is its middle.
struct TorusShape {
  /// Radius of the circle in the middle of the tube, mm.
  double radius_mm = 4.0;
  /// Radius of the tube, mm: below that of the circle.
  double tube_radius_mm = 1.0;
  static constexpr const char* name = "torus";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("radius_mm", self.radius_mm);
    out("tube_radius_mm", self.tube_radius_mm);
  }
};

/// Ridges along y on a base. Its origin lies in the plane of their tops, in the middle.
struct GratingShape {
  /// Number of ridges: 1 to 1000.
  std::uint32_t ridges = 5;
  /// Width of a ridge, mm.
  double ridge_mm = 1.5;
  /// Width of a groove, mm.
  double groove_mm = 1.5;
  /// Depth of the grooves, mm.
  double height_mm = 1.5;
  /// Radius of all edges, mm: at most half a ridge, half the length and 2 mm.
  double edge_radius_mm = 0.25;
  /// Length along y, mm.
  double length_mm = 20.0;
  static constexpr const char* name = "grating";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("ridges", self.ridges);
    out("ridge_mm", self.ridge_mm);
    out("groove_mm", self.groove_mm);
    out("height_mm", self.height_mm);
    out("edge_radius_mm", self.edge_radius_mm);
    out("length_mm", self.length_mm);
  }
};

/// Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle.
struct DotsShape {
  /// Dots along x and y: 1 to 1000 each.
  std::array<std::uint32_t, 2> count{3, 2};
  /// Distance of neighbours, mm: at least the width of a dot.
  double pitch_mm = 2.34;
  /// Width of a dot where it meets the plate, mm.
  double base_mm = 1.44;
  /// Height of a dot, mm: at most half its width.
  double height_mm = 0.48;
  /// Side lengths of the plate, mm; it has to hold the dots and 1 mm around them.
  std::array<double, 2> plate_mm{20.0, 20.0};
  static constexpr const char* name = "dots";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("count", self.count);
    out("pitch_mm", self.pitch_mm);
    out("base_mm", self.base_mm);
    out("height_mm", self.height_mm);
    out("plate_mm", self.plate_mm);
  }
};

/// A surface of listed heights. Its origin is the middle of the grid.
struct HeightmapShape {
  /// Number of heights along x: 2 or more.
  std::uint32_t columns = 2;
  /// Distance between neighbouring heights along x and y, mm.
  std::array<double, 2> pixel_mm{0.1, 0.1};
  /// Heights above the origin, mm, row by row from the lowest y; two rows or more.
  std::vector<double> heights_mm;
  static constexpr const char* name = "heightmap";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("columns", self.columns);
    out("pixel_mm", self.pixel_mm);
    out("heights_mm", self.heights_mm);
  }
};

/// A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so.
struct MeshShape {
  /// x, y, z of each vertex, mm.
  std::vector<std::array<double, 3>> vertices_mm;
  /// Three vertices for each triangle, counter-clockwise as seen from outside.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  static constexpr const char* name = "mesh";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("vertices_mm", self.vertices_mm);
    out("triangles", self.triangles);
  }
};

/// A shape that this client does not know: its members as JSON, without braces and without its name.
struct OtherShape {
  std::string name;
  std::string json;
};

struct UnionPart;

/// Parts that move as one body.
struct UnionShape {
  /// The parts, 1 to 64.
  std::vector<UnionPart> parts;
  static constexpr const char* name = "union";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("parts", self.parts);
  }
};

/// A shape of an object. Lengths are in mm, above 0 and at most 1000 unless a member says otherwise.
using Shape = std::variant<std::monostate, PlateShape, SphereShape, CylinderShape, WedgeShape, PunchShape, RingShape, BoxShape, CapsuleShape, TorusShape, GratingShape, DotsShape, HeightmapShape, MeshShape, UnionShape, OtherShape>;

/// A part of a union, moved and turned in the union's axes.
struct UnionPart {
  /// What it is: any shape but a union.
  Shape part;
  /// Where its own origin lies, mm.
  std::array<double, 3> at_mm{0.0, 0.0, 0.0};
  /// Turn about the union's z, degrees: the first of the three.
  double yaw_deg = 0.0;
  /// Turn about the union's y, degrees. A height map has to leave it 0.
  double pitch_deg = 0.0;
  /// Turn about the union's x, degrees. A height map has to leave it 0.
  double roll_deg = 0.0;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("part", self.part);
    out("at_mm", self.at_mm);
    out("yaw_deg", self.yaw_deg);
    out("pitch_deg", self.pitch_deg);
    out("roll_deg", self.roll_deg);
  }
};

/// What an object is made of, as far as the skin feels it.
struct TouchMaterial {
  /// The pressure that pushes its surface in by 1 mm, MPa/mm: above 0. Left out: it is rigid.
  std::optional<double> stiffness_mpa_per_mm;
  /// Coulomb's coefficient of friction with the skin: 0 to 10.
  double friction = 0.0;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("stiffness_mpa_per_mm", self.stiffness_mpa_per_mm);
    out("friction", self.friction);
  }
};

/// An object that can be touched; each frame gives its pose.
struct TouchObject {
  /// Its shape, and its size in millimetres.
  Shape shape;
  /// What it is made of; by default rigid and without friction.
  TouchMaterial material;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("shape", self.shape);
    TouchMaterial::visit(self.material, out);
  }
};

/// A finger of the session.
struct TouchFinger {
  /// Which of the service's fingers it is, as GET /v1/fingers lists them. Left out: the default finger.
  std::string name;
  /// Its width divided by that of the finger of this name: 0.25 to 4.
  double width = 1.0;
  /// Stiffness of its tissue divided by that of the finger of this name: 0.25 to 4.
  double stiffness = 1.0;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out.unless_empty("name", self.name);
    out("width", self.width);
    out("stiffness", self.stiffness);
  }
};

/// A place on the finger: `SkinPoint::mm(11.25, 0, -6.5)` or `SkinPoint::px(112, 90)`.
struct SkinPoint {
  bool is_px = true;
  std::array<double, 3> at{};
  /// The pixel nearest to a point of the undeformed finger, mm in the finger's frame; at most 2 mm off.
  static SkinPoint mm(double x, double y, double z) { return {false, {x, y, z}}; }
  /// A point of the map, pixels; v down.
  static SkinPoint px(double u, double v) { return {true, {u, v, 0.0}}; }
};

/// An actuator of a tactile display.
struct Actuator {
  /// Its place on the finger.
  SkinPoint at;
  /// Radius of what it averages over, or of its pin, mm. Left out: that of the effect.
  std::optional<double> radius_mm;
  /// Intensity for each unit of the input above the threshold. Left out: that of the effect.
  std::optional<double> gain;
  /// Input below which the intensity is 0. Left out: that of the effect.
  std::optional<double> threshold;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("at", self.at);
    out("radius_mm", self.radius_mm);
    out("gain", self.gain);
    out("threshold", self.threshold);
  }
};

/// A simulated nerve fibre.
struct NerveUnit {
  /// Its class.
  UnitClass unit_class = UnitClass::sa1;
  /// Its place on the finger.
  SkinPoint at;
  /// Which of TouchSim's neurons of the class: 0 to 3, for ra 0 to 8.
  std::uint32_t model = 0;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("class", self.unit_class);
    out("at", self.at);
    out("model", self.model);
  }
};

/// A term of a Prony series.
struct PronyTerm {
  /// Share of the modulus that relaxes: above 0; all together at most 0.99.
  double g = 0.0;
  /// Its time constant, s.
  double tau_s = 1.0;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("g", self.g);
    out("tau_s", self.tau_s);
  }
};

/// Answers carry a summary: force, contact area and fourteen other numbers.
struct SummaryEffect {
  static constexpr const char* name = "summary";
};

/// Answers carry SED at points of the finger.
struct PointsEffect {
  /// The points, 1 to 1024.
  std::vector<SkinPoint> points;
  static constexpr const char* name = "points";
  /// The parameter is the list itself.
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out.list(self.points);
  }
};

/// Answers carry firing rates of slowly adapting nerve fibres, Hz.
struct AfferentsEffect {
  /// Elastic modulus of the dermis, kPa.
  double e_ref_kpa = 80.0;
  /// Threshold, kPa.
  double theta_kpa = 8.0;
  /// Static sensitivity, Hz/kPa.
  double k_s_hz_per_kpa = 1.0;
  /// Dynamic sensitivity, Hz s/kPa.
  double k_d_hz_s_per_kpa = 0.2;
  /// False: no map of rates; points, summary and actuators still use them.
  bool map = true;
  static constexpr const char* name = "afferents";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("e_ref_kpa", self.e_ref_kpa);
    out("theta_kpa", self.theta_kpa);
    out("k_s_hz_per_kpa", self.k_s_hz_per_kpa);
    out("k_d_hz_s_per_kpa", self.k_d_hz_s_per_kpa);
    out("map", self.map);
  }
};

/// Answers carry when simulated nerve fibres fired.
struct SpikesEffect {
  /// Seed of the random places, of the models of units and of the noise.
  std::uint32_t seed = 1;
  /// Slowly adapting units for each cm2.
  double sa1_per_cm2 = 70.0;
  /// Rapidly adapting units for each cm2.
  double ra_per_cm2 = 140.0;
  /// Pacinian units for each cm2.
  double pc_per_cm2 = 21.0;
  /// Units of your own in place of those at random, 1 to 4096.
  std::vector<NerveUnit> units;
  /// Elastic modulus of the dermis, kPa.
  double e_ref_kpa = 80.0;
  /// Whether noise is added to the membranes.
  bool noise = false;
  /// Most spikes in one answer: 1 to 16384.
  std::uint32_t spikes_max = 1024;
  static constexpr const char* name = "spikes";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("seed", self.seed);
    out("sa1_per_cm2", self.sa1_per_cm2);
    out("ra_per_cm2", self.ra_per_cm2);
    out("pc_per_cm2", self.pc_per_cm2);
    out.unless_empty("units", self.units);
    out("e_ref_kpa", self.e_ref_kpa);
    out("noise", self.noise);
    out("spikes_max", self.spikes_max);
  }
};

/// Answers carry an intensity for each actuator of a tactile display.
struct ActuatorsEffect {
  /// The actuators, 1 to 1024.
  std::vector<Actuator> actuators;
  /// Radius of what an actuator averages over, or of its pin, mm, where it has none of its own.
  std::optional<double> radius_mm;
  /// Intensity for each unit of the input above the threshold, where an actuator has none of its own.
  std::optional<double> gain;
  /// Input below which the intensity is 0, in its unit.
  double threshold = 0.0;
  /// Greatest intensity.
  double max = 1.0;
  /// What drives them; firing rates need the effect afferents.
  ActuatorInput input = ActuatorInput::sed;
  /// How intensities are computed.
  ActuatorDrive drive = ActuatorDrive::formula;
  static constexpr const char* name = "actuators";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("actuators", self.actuators);
    out("radius_mm", self.radius_mm);
    out("gain", self.gain);
    out("threshold", self.threshold);
    out("max", self.max);
    out("input", self.input);
    out("drive", self.drive);
  }
};

/// The tissue creeps under a constant pressure.
struct RelaxationEffect {
  /// Whose creep it is.
  Tissue tissue = Tissue::subcutaneous;
  /// A series of your own in place of the tissue's, one to six terms.
  std::vector<PronyTerm> prony;
  /// Which stiffness the training had.
  Moduli moduli = Moduli::instantaneous;
  static constexpr const char* name = "relaxation";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("tissue", self.tissue);
    out.unless_empty("prony", self.prony);
    out("moduli", self.moduli);
  }
};

/// SED takes account of traction along the skin; needs friction.
struct ShearEnergyEffect {
  static constexpr const char* name = "shear_energy";
};

/// The map is cut to the region in contact.
struct ContactWindowEffect {
  /// Margin around it, pixels.
  std::uint32_t margin_px = 24;
  static constexpr const char* name = "contact_window";
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("margin_px", self.margin_px);
  }
};

/// An effect that this client does not know, such as one of a tier: its name, and its parameters as JSON (empty: none).
struct OtherEffect {
  std::string name;
  std::string json;
};

/// What the service computes beside the map, because the hello names it.
using Effect = std::variant<SummaryEffect, PointsEffect, AfferentsEffect, SpikesEffect, ActuatorsEffect, RelaxationEffect, ShearEnergyEffect, ContactWindowEffect, OtherEffect>;

/// What a session asks for.
struct Hello {
  /// What frames hold. Left out: objects if there are any in the hello, pressure if not.
  std::optional<FrameInput> input;
  /// Places of the samples of pressure or gaps.
  SampleLayout input_layout = SampleLayout::map;
  /// Type of the samples of frames. Poses are f32; gaps are f32 or f16.
  SampleType sample_type = SampleType::f32;
  /// Pressure that one unit of a u16 or u8 sample stands for, Pa.
  std::optional<double> pressure_scale_pa;
  /// What happens to pressure beyond the training.
  OutOfRangeRule out_of_range = OutOfRangeRule::clamp;
  /// Frames of pressure at vertices also hold the traction.
  bool traction = false;
  /// The objects, 1 to 16, whose poses frames hold.
  std::vector<TouchObject> objects;
  /// The fingers, 1 to 10. None: the default finger alone.
  std::vector<TouchFinger> fingers;
  /// Each frame holds a net force with which the objects are to press.
  bool force_target = false;
  /// Coulomb's coefficient of friction of what gaps tell of: 0 to 10. Left out: none.
  std::optional<double> friction;
  /// Frames of gaps also hold velocities, mm/s.
  bool velocity = false;
  /// A frame that was delayed for longer on its way is stale, us. Left out: none is.
  std::optional<std::uint32_t> stale_after_us;
  /// False: answers carry no SED at pixels or vertices.
  bool map = true;
  /// Places of the SED in answers.
  SampleLayout answer_layout = SampleLayout::map;
  /// Type of SED and firing rates in answers. Left out: that of frames.
  std::optional<SampleType> answer_sample_type;
  /// Answers to objects and gaps carry the pressure that was found, Pa, at these places.
  std::optional<SampleLayout> pressure;
  /// Answers to objects and gaps carry the traction along the skin, Pa, at the vertices.
  bool shear = false;
  /// Answers to objects and gaps carry how far the skin has moved, mm, at the vertices.
  bool displacement = false;
  /// Answers say how wrong they are likely to be.
  bool error_estimate = false;
  /// Answers to objects and gaps carry the local stiffness, N/mm.
  bool stiffness = false;
  /// What is computed beside the map; nothing else is.
  std::vector<Effect> effects;
  /// Pressure above which a pixel counts as in contact, Pa.
  double contact_pa = 0.0;
  /// A tier by its name. Left out: the service chooses, by the budget if there is one.
  std::string tier;
  /// Time that a frame may spend in the service, us. Left out: no deadline.
  std::optional<std::uint32_t> budget_us;
  /// How contact is solved. Left out: the most accurate method that can serve the hello.
  std::optional<ContactMethod> method;
  /// Hash of the atlas that you draw with; the hello is refused if the tier has another.
  std::string atlas_hash;
  /// Members that this client does not know, as JSON without braces.
  std::string more;
  template <class Self, class Out>
  static void visit(Self& self, Out& out) {
    out("input", self.input);
    out.unless("input_layout", self.input_layout, SampleLayout::map);
    out.unless("sample_type", self.sample_type, SampleType::f32);
    out("pressure_scale_pa", self.pressure_scale_pa);
    out.unless("out_of_range", self.out_of_range, OutOfRangeRule::clamp);
    out.unless("traction", self.traction, false);
    out.unless_empty("objects", self.objects);
    out.unless_empty("fingers", self.fingers);
    out.unless("force_target", self.force_target, false);
    out("friction", self.friction);
    out.unless("velocity", self.velocity, false);
    out("stale_after_us", self.stale_after_us);
    out.unless("map", self.map, true);
    out.unless("answer_layout", self.answer_layout, SampleLayout::map);
    out("answer_sample_type", self.answer_sample_type);
    out("pressure", self.pressure);
    out.unless("shear", self.shear, false);
    out.unless("displacement", self.displacement, false);
    out.unless("error_estimate", self.error_estimate, false);
    out.unless("stiffness", self.stiffness, false);
    out.unless("contact_pa", self.contact_pa, 0.0);
    out.unless_empty("tier", self.tier);
    out("budget_us", self.budget_us);
    out("method", self.method);
    out.unless_empty("atlas_hash", self.atlas_hash);
  }

  /// All members as JSON, without braces, type and version.
  std::string members() const {
    detail::HelloWriter out;
    if (!input && !objects.empty()) out("input", FrameInput::objects);
    visit(*this, out);
    if (!effects.empty()) out.effects(effects);
    if (!more.empty()) out.raw(more);
    return out.text;
  }
};

}  // namespace papilla
