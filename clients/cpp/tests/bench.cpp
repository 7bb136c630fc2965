// Round trips of the C++ client at a steady rate, as one line of JSON (docs/reports/clients.md).
//   bench [--rate-hz 90] [--duration-s 60] [--input objects]     PAPILLA_URL names the service
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include <papilla/papilla.hpp>

static std::atomic<unsigned long long> allocations{0};

// Both replacements below belong together; GCC sees one of them inlined and the other not.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

void* operator new(std::size_t size) {
  ++allocations;
  if (void* const block = std::malloc(size)) return block;
  std::abort();
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }

int main(int argc, char** argv) {
  double rate_hz = 90.0, duration_s = 60.0;
  bool sends_poses = false;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--rate-hz") == 0) rate_hz = std::atof(argv[i + 1]);
    if (std::strcmp(argv[i], "--duration-s") == 0) duration_s = std::atof(argv[i + 1]);
    if (std::strcmp(argv[i], "--input") == 0) sends_poses = std::strcmp(argv[i + 1], "objects") == 0;
  }
  const auto frames = static_cast<std::size_t>(rate_hz * duration_s);
  const auto warm_up = static_cast<std::size_t>(rate_hz);
  std::vector<double> times_us;
  times_us.reserve(frames + warm_up);
  papilla::Session::Options options;
  const char* const url = std::getenv("PAPILLA_URL");
  if (url) options.url = url;
  options.hello.tier = "half-space";
  if (sends_poses) {
    options.hello.objects = {{papilla::SphereShape{10.0}, {}}};
    options.hello.pressure = papilla::SampleLayout::vertices;
    options.hello.answer_layout = papilla::SampleLayout::vertices;
    options.hello.displacement = true;
  }
  const papilla::Pose ball{{11.25F, 0.0F, -16.2F}};
  // The client time is the instant at which the frame was meant to leave.
  options.on_answer = [&](const papilla::Answer& answer) {
    if (answer.status == papilla::Status::ok) {
      times_us.push_back(double(papilla::now_us() - answer.client_time_us));
    }
  };
  papilla::Session session(options);
  if (!session.open()) return std::fprintf(stderr, "%s\n", session.problem().message.c_str()), 1;
  std::vector<float> pressure_pa(papilla::map_len);
  for (std::size_t i = 0; i < papilla::map_len; ++i) {
    const double x = double(i % 224) - 112.0, y = double(i / 224) - 112.0;
    pressure_pa[i] = float(20000.0 * std::exp(-(x * x + y * y) / 288.0));
  }
  const std::uint64_t start_us = papilla::now_us() + 20000;
  unsigned long long before = 0;
  for (std::size_t i = 0; i < warm_up + frames; ++i) {
    const auto due_us = start_us + static_cast<std::uint64_t>(1e6 * double(i) / rate_hz);
    const std::uint64_t now = papilla::now_us();
    if (due_us > now) std::this_thread::sleep_for(std::chrono::microseconds(due_us - now));
    if (i == warm_up) before = allocations;
    if (sends_poses) session.send_poses(&ball, 1, 0, nullptr, due_us);
    else session.send(pressure_pa.data(), {}, due_us);
  }
  const unsigned long long made = allocations - before;
  std::this_thread::sleep_for(std::chrono::seconds(1));
  session.close();
  times_us.erase(times_us.begin(), times_us.begin() + std::ptrdiff_t(std::min(warm_up, times_us.size())));
  if (times_us.empty()) return std::fputs("no answers\n", stderr), 1;
  std::sort(times_us.begin(), times_us.end());
  const auto share = [&](double of) { return times_us[std::size_t(of * double(times_us.size() - 1))]; };
  std::printf("{\"client\": \"cpp\", \"rate_hz\": %g, \"frames\": %zu, \"p50_us\": %.0f, \"p99_us\": %.0f, "
              "\"max_us\": %.0f, \"missing\": %zu, \"allocations_per_frame\": %g}\n",
              rate_hz, times_us.size(), share(0.5), share(0.99), share(1.0), frames - std::min(frames, times_us.size()),
              double(made) / double(frames));
  return 0;
}
