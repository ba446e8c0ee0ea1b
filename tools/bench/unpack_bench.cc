// relmap-bench unpack: raw frames of a stereo camera taken apart, beside the plain loop and a copy of as many bytes.
// One thread; the methods are measured in turn, so that disturbances affect all of them.
#include <chrono>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "frontend/capture/stereo_layout.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::size_t kBuffers = 8;  // as a camera's driver has: a frame is not in the nearest cache when it is taken

struct UnpackOptions {
  int width = 640, height = 480, rounds = 2000;
};

template <typename Work>
double milliseconds_of(Work work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return 1e3 * seconds_since(begin);
}

void run(const UnpackOptions& options, Report& report) {
  capture::StereoLayout grey{options.width, options.height, capture::FirstByte::kRight, capture::ColourFilter::kNone},
      bayer = grey;
  bayer.filter = capture::ColourFilter::kGRBG;
  std::mt19937 random(1);
  std::vector<std::vector<std::uint8_t>> frames(kBuffers, std::vector<std::uint8_t>(grey.bytes()));
  for (auto& frame : frames)
    for (std::uint8_t& byte : frame) byte = static_cast<std::uint8_t>(random());
  vision::Image left, right;
  std::vector<std::uint8_t> copy(grey.bytes());
  std::size_t taken = 0;
  const auto next = [&]() -> const std::vector<std::uint8_t>& { return frames[taken++ % kBuffers]; };
  const auto by = [&](auto* unpacker, const capture::StereoLayout& layout) {
    return milliseconds_of([&] {
      if (Status status = unpacker(layout, next(), left, right); !status.ok()) throw StatusError(status);
    });
  };

  std::vector<double> unpack_ms, bayer_ms, plain_ms, plain_bayer_ms, copy_ms;
  for (int i = 0; i < options.rounds; ++i) {
    copy_ms.push_back(milliseconds_of([&] { std::memcpy(copy.data(), next().data(), copy.size()); }));
    unpack_ms.push_back(by(&capture::unpack, grey));
    bayer_ms.push_back(by(&capture::unpack, bayer));
    plain_ms.push_back(by(&capture::detail::unpack_plainly, grey));
    plain_bayer_ms.push_back(by(&capture::detail::unpack_plainly, bayer));
  }
  const auto median = [](const std::vector<double>& samples) { return quantile(samples, 0.5); };
  report.add("unpack_ms", median(unpack_ms), "a grey frame into its two eyes, median");
  report.add("unpack_p99_ms", quantile(unpack_ms, 0.99), "the same, 99th percentile");
  report.add("unpack_bayer_ms", median(bayer_ms), "a frame under a colour filter into two grey eyes, median");
  report.add("unpack_bayer_p99_ms", quantile(bayer_ms, 0.99), "the same, 99th percentile");
  report.add("memcpy_ms", median(copy_ms), "the bytes of a frame copied, median");
  report.add("unpack_over_memcpy", median(unpack_ms) / median(copy_ms), "unpack_ms over memcpy_ms");
  report.add("unpack_bayer_over_memcpy", median(bayer_ms) / median(copy_ms), "unpack_bayer_ms over memcpy_ms");
  report.add("plain_over_unpack", median(plain_ms) / median(unpack_ms),
             "the plain loop, as the compiler makes it, over unpack_ms");
  report.add("plain_over_unpack_bayer", median(plain_bayer_ms) / median(bayer_ms),
             "the plain loop, as the compiler makes it, over unpack_bayer_ms");
}

}  // namespace

Run declare_unpack(CLI::App& app) {
  const auto options = std::make_shared<UnpackOptions>();
  app.add_option("--width", options->width, "width of one eye's picture, pixels")
      ->check(CLI::Range(2, 4096))
      ->capture_default_str();
  app.add_option("--height", options->height, "height of one eye's picture, pixels")
      ->check(CLI::Range(2, 4096))
      ->capture_default_str();
  app.add_option("--rounds", options->rounds, "frames that each method unpacks")->check(CLI::Range(1, 1000000));
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
