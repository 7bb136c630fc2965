// Parts that a session against the service exercises only in its good cases.
#include <clocale>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <papilla/papilla.hpp>
#include <papilla/pieces.hpp>

static int failures = 0;
#define CHECK(what) \
  if (!(what)) ++failures, std::printf("%s:%d: %s\n", __FILE__, __LINE__, #what)

static void pieces() {
  papilla::Pieces pieces;
  const std::string text(70000, 'a');
  CHECK(!pieces.add(text.data(), 65536, false));
  CHECK(pieces.add(text.data(), 4464, true) && pieces.message().size() == 70000);
  CHECK(pieces.add("xyz", 3, true) && pieces.message().size() == 3);
  CHECK(!pieces.add("half", 4, false));
  pieces.reset();
  CHECK(pieces.add("new", 3, true) && pieces.message().size() == 3);
  for (int i = 0; i < 20; ++i) CHECK(!pieces.add(text.data(), text.size(), false));
  CHECK(!pieces.add(text.data(), text.size(), true));
  CHECK(pieces.add("ok", 2, true) && pieces.message().size() == 2);
}

static void halves() {
  // Every half that is a number comes back, and what lies between two goes to the nearer.
  for (std::uint32_t half = 0; half < 0x10000; ++half) {
    const auto bits = static_cast<std::uint16_t>(half);
    if ((bits & 0x7c00) == 0x7c00) continue;
    CHECK(papilla::to_half(papilla::from_half(bits)) == bits);
    if ((bits & 0x7fff) < 0x7bff) {
      const float low = papilla::from_half(bits), high = papilla::from_half(static_cast<std::uint16_t>(bits + 1));
      CHECK(papilla::to_half(0.75F * low + 0.25F * high) == bits);
      CHECK((papilla::to_half(0.5F * low + 0.5F * high) & 1) == 0);
    }
  }
  CHECK(papilla::to_half(1e9F) == 0x7bff && papilla::to_half(-65519.0F) == 0xfbff);
  CHECK(std::isnan(papilla::from_half(papilla::to_half(std::nanf("")))));
}

static void json() {
  using papilla::json::parse;
  papilla::json::Value value;
  CHECK(parse(R"( {"a": [1, -2.5e3, true, null, "x\"\u00e9\ud83d\ude00\n"], "b": {}} )", value));
  CHECK(value["a"][1].number == -2500.0 && value["a"][2].boolean && value["a"][3].is_null());
  CHECK(value["a"][4].string == "x\"\xc3\xa9\xf0\x9f\x98\x80\n" && !value.has("c") && value["c"]["d"].is_null());
  for (const char* bad : {"", "{", "[1,", "{\"a\" 1}", "tru", "\"a", "[1] 2", "1..2", "\"\\ud800\"", "-", "[1,]"}) {
    CHECK(!parse(bad, value));
  }
  CHECK(!parse(std::string(100000, '['), value));
}

static void numbers() {
  using papilla::number::print, papilla::number::read;
  double value = 0.0;
  for (const double due : {0.0, -2500.0, 1.5, 0.1, 1e-300, 1.7976931348623157e308, 4294967295.0, 12345.678901234567}) {
    CHECK(read(print(due), value) && value == due);
    CHECK(print(due).find(',') == std::string::npos);
  }
  CHECK(read("1E3", value) && value == 1000.0);
  for (const char* bad : {"", "-", "+1", "1..2", "1,5", "1.5,", "1e", " 1", "1 ", "1e999", "inf", "nan"}) CHECK(!read(bad, value));
  CHECK(print(std::nan("")) == "null");
}

// A hello that cannot be read is refused here, with the place: an empty one took its place.
static void hellos() {
  papilla::Session::Options options;
  options.hello.more = R"("objects": [{"shape": {"shape": "sphere", "radius_mm": 10,5}}])";
  papilla::Session session(options);
  CHECK(!session.open() && session.problem().code == "bad_json");
  CHECK(session.problem().message.find("10,5") != std::string::npos);
}

// What is said of types, defaults and all; members of the hello that are as usual are not.
static void typed_hellos() {
  using namespace papilla;
  Hello hello;
  CHECK(hello.members().empty());
  hello.objects = {{SphereShape{10.5}, {0.5, 0.25}}, {UnionShape{{{PlateShape{}, {0.0, 0.0, -4.0}}}}, {}}};
  hello.effects = {SummaryEffect{}, PointsEffect{{SkinPoint::px(112, 90), SkinPoint::mm(11.25, 0, -6.5)}}, OtherEffect{"layers", ""}};
  hello.map = false;
  hello.more = R"("new_member": 1)";
  const std::string due =
      R"("input":"objects","objects":[{"shape":{"shape":"sphere","radius_mm":10.5},"stiffness_mpa_per_mm":0.5,"friction":0.25},)"
      R"({"shape":{"shape":"union","parts":[{"part":{"shape":"plate","size_mm":[20,20],"edge_radius_mm":1},"at_mm":[0,0,-4],)"
      R"("yaw_deg":0,"pitch_deg":0,"roll_deg":0}]},"friction":0}],"map":false,"effects":["summary","points","layers"],)"
      R"("points":[{"px":[112,90]},{"mm":[11.25,0,-6.5]}],"new_member": 1)";
  CHECK(hello.members() == due);
  // An object without a shape is said to have none, and not taken for another.
  Hello bare;
  bare.objects.resize(1);
  CHECK(bare.members() == R"("input":"objects","objects":[{"shape":null,"friction":0}])");
}

static void messages() {
  // Whatever comes, the core neither crashes nor takes it for an answer.
  papilla::Core core;
  int outcomes = 0;
  core.on_answer = [&](const papilla::Answer&) { ++outcomes; };
  CHECK(core.text("no json") == papilla::Core::Event::broken);
  CHECK(core.text(R"({"type": "ready", "version": 3, "sample_type": "f32", "sections": [{"name": "map", "offset": 48, "bytes": 200704}]})") ==
        papilla::Core::Event::ready);
  const std::vector<float> map(papilla::map_len, 1.0F);
  const std::uint32_t sequence = core.send(map.data(), {}, 7);
  papilla::Outgoing* const frame = core.take();
  CHECK(frame && frame->size == 48 + 4 * papilla::map_len && core.in_flight() == 1);
  std::vector<std::uint8_t> answer(frame->data(), frame->data() + frame->size);
  answer[5] = 2;
  CHECK(core.binary(answer.data(), 47) == papilla::Core::Event::broken);
  CHECK(core.binary(answer.data(), answer.size() - 1) == papilla::Core::Event::broken && outcomes == 0);
  core.send(map.data(), {}, 8);
  core.send(map.data(), {}, 9);
  CHECK(outcomes == 1 && core.superseded_by_client() == 1);
  core.lost();
  CHECK(core.in_flight() == 0 && core.waiting() && !core.can_take());
  core.end();
  CHECK(!core.waiting() && sequence == 1);
}

static void put_u32(std::uint8_t* at, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) at[k] = static_cast<std::uint8_t>(value >> 8 * k);
}

// Two spikes of a section with room for three, and the traction of two vertices.
static void spikes_and_shear() {
  papilla::Core core;
  papilla::Answer got;
  core.on_answer = [&](const papilla::Answer& answer) { got = answer; };
  CHECK(core.text(R"({"type": "ready", "version": 3, "sample_type": "f32", "sections": [
    {"name": "shear", "offset": 48, "bytes": 24}, {"name": "spikes", "offset": 72, "bytes": 20}]})") == papilla::Core::Event::ready);
  const std::vector<float> map(papilla::map_len, 1.0F);
  const auto answered = [&](std::uint32_t count) {
    core.send(map.data(), {}, 100);
    papilla::Outgoing* const frame = core.take();
    std::vector<std::uint8_t> answer(frame->data(), frame->data() + 92);
    std::fill(answer.begin() + 48, answer.end(), std::uint8_t(0));
    answer[5] = 2;
    put_u32(&answer[48 + 4], 0x3f800000);   // 1.0 Pa along y of the first vertex
    put_u32(&answer[72], 7);
    put_u32(&answer[76], count);
    put_u32(&answer[80], 3 | 60u << 16);
    put_u32(&answer[84], 5 | 65535u << 16);
    return core.binary(answer.data(), answer.size());
  };
  CHECK(answered(2) != papilla::Core::Event::broken && got.status == papilla::Status::ok);
  CHECK(got.shear_pa.size() == 6 && got.shear_pa[1] == 1.0F && got.shear_pa[0] == 0.0F);
  CHECK(got.spikes.size() == 2 && got.spikes_total == 7);
  CHECK(got.spikes[0].unit == 3 && got.spikes[0].time_us == 40);
  CHECK(got.spikes[1].unit == 5 && got.spikes[1].time_us == 100 - 65535);
  // More than the section holds are none.
  CHECK(answered(4) == papilla::Core::Event::broken);
}

static void fingers() {
  // The newest frame of each finger leaves, in turns, at the place of the protocol.
  papilla::Core core("\"input\": \"objects\"");
  CHECK(core.hello() == R"({"type":"hello","version":3,"input": "objects"})");
  CHECK(papilla::Core("\"tier\": \"nano\"").hello() == R"({"type":"hello","version":3,"tier": "nano"})");
  std::vector<int> superseded;
  core.on_answer = [&](const papilla::Answer& answer) { superseded.push_back(answer.finger); };
  core.text(R"({"type": "ready", "version": 3, "sample_type": "u16", "sections": [{"name": "touch", "offset": 48, "bytes": 64}]})");
  const papilla::Pose pose{{1.0F, 2.0F, 3.0F}};
  const papilla::NetForce net{{0.0F, 1.0F, 0.0F}, 0.5F};
  core.send_poses(&pose, 1, 7, 0);
  core.send_poses(&pose, 1, 7, 4);
  core.send_poses(&pose, 1, 7, 0, &net);
  CHECK(superseded == std::vector<int>{0});
  std::vector<int> left;
  while (papilla::Outgoing* const frame = core.take()) {
    const std::uint8_t* const at = frame->data();
    CHECK(at[4] == 3 && at[5] == 4 && at[6] == 0 && at[12] == 7 && papilla::wire::get_float(at + 52) == 2.0F);
    if (at[47] == 0) CHECK(at[14] == 2 && frame->size == 48 + 56 && papilla::wire::get_float(at + 88) == 0.5F);
    left.push_back(at[47]);
  }
  CHECK((left == std::vector<int>{4, 0}) || (left == std::vector<int>{0, 4}));
  core.lost();
  CHECK(superseded.size() == 3 && superseded[1] + superseded[2] == 4);
}

// What is no place is refused; what is drawn is what is felt.
static void places() {
  using namespace papilla::frames;
  const Place finger{{0.0, 1.0, 0.0}, {0.0, 0.0, 0.0, 2.0}}, ball{{0.002, 0.992, -0.01125}, {0.0, 0.0, 0.0, 0.5}};
  const std::optional<papilla::Pose> pose = to_finger(unity, finger, ball);
  CHECK(pose && std::abs(pose->origin_mm[0] - 11.25F) < 1e-4F && std::abs(pose->origin_mm[1] - 2.0F) < 1e-4F &&
        std::abs(pose->origin_mm[2] + 8.0F) < 1e-4F && pose->quaternion[3] == 1.0F);
  const Place nowhere{{0.0, NAN, 0.0}, {0.0, 0.0, 0.0, 1.0}}, zero{{}, {0.0, 0.0, 0.0, 0.0}};
  for (const Place& wrong : {nowhere, zero}) {
    CHECK(!to_finger(unity, wrong, ball) && !to_finger(unity, ball, wrong) && !felt(unity, wrong, {}));
    CHECK(!finger_of_joints(openxr, wrong, ball) && !finger_of_joints(openxr, ball, wrong));
  }
  CHECK(!to_finger(unity, finger, ball, 0.0) && !finger_of_joints(openxr, ball, ball));
  const Three mm{11.25, 2.0, -6.5};
  for (const Convention& each : {metres, openxr, unity, unreal}) {
    const Three back = vertex_mm(each, vertex_drawn(each, mm));
    CHECK(std::abs(back[0] - mm[0]) + std::abs(back[1] - mm[1]) + std::abs(back[2] - mm[2]) < 1e-9);
    const std::optional<papilla::Pose> there = to_finger(each, {}, {vertex_drawn(each, mm), {0.0, 0.0, 0.0, 1.0}});
    CHECK(there && std::abs(there->origin_mm[2] + 6.5F) < 1e-4F && std::abs(there->origin_mm[1] - 2.0F) < 1e-4F);
  }
}

static void proofs() {
  // RFC 6455, 1.3.
  const auto digest = papilla::detail::sha1("dGhlIHNhbXBsZSBub25jZQ==258EAFA5-E914-47DA-95CA-C5AB0DC85B11");
  CHECK(papilla::detail::base64(digest.data(), digest.size()) == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
}

// Whoever takes a connection and says nothing is told by its address.
static void silence() {
  const int listening = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in place{};
  socklen_t size = sizeof place;
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr* const at = reinterpret_cast<sockaddr*>(&place);
  CHECK(::bind(listening, at, size) == 0 && ::listen(listening, 4) == 0 && ::getsockname(listening, at, &size) == 0);
  std::thread mute([&] {
    for (int taken; (taken = ::accept(listening, nullptr, nullptr)) >= 0;) ::close(taken);
  });
  papilla::Session::Options options;
  options.url = "127.0.0.1:" + std::to_string(ntohs(place.sin_port));
  papilla::Session session(options);
  const std::string due = options.url + ": no answer; is papilla-server running there?";
  CHECK(!session.open() && session.problem().message == due);
  CHECK(papilla::http(options.url, "GET", "/v1/atlas").problem.message == due);
  ::shutdown(listening, SHUT_RDWR);
  mute.join();
  ::close(listening);
  CHECK(!session.open() && session.problem().message == options.url + ": nobody listens; is papilla-server running there?");
}

int main() {
  // As a desktop's program does: numbers of the protocol must not follow.
  std::setlocale(LC_ALL, "");
  pieces();
  numbers();
  hellos();
  typed_hellos();
  halves();
  json();
  messages();
  spikes_and_shear();
  fingers();
  places();
  proofs();
  silence();
  std::printf(failures ? "%d checks failed\n" : "all checks passed\n", failures);
  return failures ? 1 : 0;
}
