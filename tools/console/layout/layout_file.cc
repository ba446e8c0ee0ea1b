#include "tools/console/layout/layout_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "proto/base/crc32c.h"

namespace relmap::console {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "RMLAYOUT";
constexpr std::size_t kHeader = 8 + 4 + 4 + 8;
constexpr std::size_t kPointBytes = 3 * 8 + 3 * 4 + 3 * 4 + 3 * 4 + 1, kRunBytes = 16,
                      kClosureBytes = 12 + 8 + 8 + 2 + 20, kLeastPartBytes = 8 + 8 + 32 + 4, kTearBytes = 12 + 16 + 24;

void put(ByteWriter& out, FrameId frame) {
  out.put(frame.session);
  out.put(frame.index);
}
FrameId get_frame(ByteReader& in) {
  const auto session = in.get<std::uint32_t>();
  return {session, in.get<std::uint32_t>()};
}
void put(ByteWriter& out, const EdgeId& edge) {
  put(out, edge.frame);
  out.put(edge.ordinal);
}
EdgeId get_edge(ByteReader& in) {
  const FrameId frame = get_frame(in);
  return {frame, in.get<std::uint32_t>()};
}

void put_all(ByteWriter& out, const MapLayout& layout) {
  out.put_array(layout.map.uuid.bytes.data(), layout.map.uuid.bytes.size());
  out.put(layout.map.epoch);
  out.put_string(layout.boot_id);
  out.put(layout.map_version);
  out.put(layout.commit_number);
  out.put(layout.version);
  out.put(layout.level);
  out.put(static_cast<std::uint8_t>(layout.coarse));
  out.put(static_cast<std::uint8_t>(layout.converged));
  out.put(layout.seconds);
  out.put(layout.frames);
  out.put(layout.first_ms);
  out.put(layout.last_ms);
  out.put(layout.corner.x());
  out.put(layout.corner.y());
  out.put(layout.size);
  out.put(layout.zooms);
  out.put(layout.torn_in_all);
  out.put(static_cast<std::uint32_t>(layout.points.size()));
  for (const MapLayout::Point& point : layout.points) {
    out.put_array(point.position.data(), 3);
    out.put_array(point.rotation.data(), 3);
    out.put(point.index);
    out.put(point.time_s);
    out.put(point.frames);
    out.put(point.translation_variance);
    out.put(point.rotation_variance);
    out.put(point.importance);
    out.put(point.flags);
  }
  out.put(static_cast<std::uint32_t>(layout.runs.size()));
  for (const MapLayout::Run& run : layout.runs)
    for (const std::uint32_t number : {run.session, run.first, run.end, run.part}) out.put(number);
  out.put(static_cast<std::uint32_t>(layout.closures.size()));
  for (const MapLayout::Closure& closure : layout.closures) {
    put(out, closure.id);
    put(out, closure.a);
    out.put(closure.at_a);
    out.put(closure.at_b);
    out.put(static_cast<std::uint8_t>(closure.state));
    out.put(static_cast<std::uint8_t>(closure.carries));
    out.put(closure.alike);
    for (const float number :
         {closure.suspicion, closure.sigmas, closure.translation_variance, closure.rotation_variance})
      out.put(number);
  }
  out.put(static_cast<std::uint32_t>(layout.parts.size()));
  for (const MapLayout::Part& part : layout.parts) {
    put(out, part.root);
    out.put(part.frames);
    for (const double metres : {part.box.low.x(), part.box.low.y(), part.box.high.x(), part.box.high.y()})
      out.put(metres);
    out.put(static_cast<std::uint32_t>(part.sessions.size()));
    out.put_array(part.sessions.data(), part.sessions.size());
  }
  out.put(static_cast<std::uint32_t>(layout.torn.size()));
  for (const client::Tear& tear : layout.torn) {
    put(out, tear.edge);
    put(out, tear.a);
    put(out, tear.b);
    for (const double number : {tear.metres, tear.degrees, tear.sigmas}) out.put(number);
  }
}

// The number of items that follow; too many for the bytes count as none, and the reader then does not end at the end.
std::size_t get_count(ByteReader& in, std::size_t item_bytes) {
  const auto count = in.get<std::uint32_t>();
  return in.fits(count, item_bytes) ? count : 0;
}

void get_all(ByteReader& in, MapLayout& layout) {
  in.get_array(layout.map.uuid.bytes.data(), layout.map.uuid.bytes.size());
  layout.map.epoch = in.get<std::uint64_t>();
  layout.boot_id = in.get_string();
  layout.map_version = in.get<std::uint64_t>();
  layout.commit_number = in.get<std::uint64_t>();
  layout.version = in.get<std::uint64_t>();
  layout.level = in.get<std::uint32_t>();
  layout.coarse = in.get<std::uint8_t>() != 0;
  layout.converged = in.get<std::uint8_t>() != 0;
  layout.seconds = in.get<double>();
  layout.frames = in.get<std::uint64_t>();
  layout.first_ms = in.get<std::int64_t>();
  layout.last_ms = in.get<std::int64_t>();
  layout.corner.x() = in.get<double>();
  layout.corner.y() = in.get<double>();
  layout.size = in.get<double>();
  layout.zooms = in.get<std::uint32_t>();
  layout.torn_in_all = in.get<std::uint64_t>();
  layout.points.resize(get_count(in, kPointBytes));
  for (MapLayout::Point& point : layout.points) {
    in.get_array(point.position.data(), 3);
    in.get_array(point.rotation.data(), 3);
    point.index = in.get<std::uint32_t>();
    point.time_s = in.get<std::uint32_t>();
    point.frames = in.get<std::uint32_t>();
    point.translation_variance = in.get<float>();
    point.rotation_variance = in.get<float>();
    point.importance = in.get<float>();
    point.flags = in.get<std::uint8_t>();
  }
  layout.runs.resize(get_count(in, kRunBytes));
  for (MapLayout::Run& run : layout.runs)
    for (std::uint32_t* number : {&run.session, &run.first, &run.end, &run.part}) *number = in.get<std::uint32_t>();
  layout.closures.resize(get_count(in, kClosureBytes));
  for (MapLayout::Closure& closure : layout.closures) {
    closure.id = get_edge(in);
    closure.a = get_frame(in);
    closure.at_a = in.get<std::uint32_t>();
    closure.at_b = in.get<std::uint32_t>();
    closure.state = static_cast<client::EdgeState>(in.get<std::uint8_t>());
    closure.carries = in.get<std::uint8_t>() != 0;
    closure.alike = in.get<std::uint32_t>();
    for (float* number :
         {&closure.suspicion, &closure.sigmas, &closure.translation_variance, &closure.rotation_variance})
      *number = in.get<float>();
  }
  layout.parts.resize(get_count(in, kLeastPartBytes));
  for (MapLayout::Part& part : layout.parts) {
    part.root = get_frame(in);
    part.frames = in.get<std::uint64_t>();
    for (double* metres : {&part.box.low.x(), &part.box.low.y(), &part.box.high.x(), &part.box.high.y()})
      *metres = in.get<double>();
    part.sessions.resize(get_count(in, sizeof(SessionNumber)));
    in.get_array(part.sessions.data(), part.sessions.size());
  }
  layout.torn.resize(get_count(in, kTearBytes));
  for (client::Tear& tear : layout.torn) {
    tear.edge = get_edge(in);
    tear.a = get_frame(in);
    tear.b = get_frame(in);
    for (double* number : {&tear.metres, &tear.degrees, &tear.sigmas}) *number = in.get<double>();
  }
}

// What all who use a layout rely on; empty: nothing is wrong.
std::string wrong_with(const MapLayout& layout) {
  constexpr double kFar = 1e9;  // metres
  if (!(layout.size >= 1e-3 && layout.size < kFar && layout.corner.cwiseAbs().maxCoeff() < kFar)) return "its world";
  if (layout.zooms > 16) return "its zooms";
  std::uint32_t end = 0;
  FrameId last;
  for (const MapLayout::Run& run : layout.runs) {
    if (run.first != end || run.end <= run.first || run.end > layout.points.size() || run.part >= layout.parts.size())
      return "a run";
    for (std::uint32_t k = run.first; k < run.end; ++k) {
      const FrameId frame = layout.frame_of(run, k);
      if (!(last < frame)) return "the order of its points";
      last = frame;
    }
    end = run.end;
  }
  if (end != layout.points.size()) return "its points";
  for (const MapLayout::Point& point : layout.points) {
    const Vector2 at = point.position.head<2>() - layout.corner;
    const bool rotation =
        std::isfinite(point.rotation[0]) && std::isfinite(point.rotation[1]) && std::isfinite(point.rotation[2]);
    if (!(at.minCoeff() >= -1e-3 && at.maxCoeff() <= layout.size + 1e-3 && std::abs(point.position.z()) < kFar) ||
        !rotation || std::isnan(point.importance) || !(point.translation_variance >= 0) ||
        !(point.rotation_variance >= 0) || !std::isfinite(point.translation_variance) ||
        !std::isfinite(point.rotation_variance))
      return "a point";
  }
  for (const MapLayout::Closure& closure : layout.closures) {
    const auto state = static_cast<int>(closure.state);
    if (closure.at_a >= layout.points.size() || closure.at_b >= layout.points.size() || state < 1 || state > 4 ||
        std::isnan(closure.suspicion) || std::isnan(closure.sigmas) || !std::isfinite(closure.translation_variance) ||
        !std::isfinite(closure.rotation_variance) || closure.translation_variance < 0 || closure.rotation_variance < 0)
      return "a closure";
  }
  for (const MapLayout::Part& part : layout.parts)
    if (!part.box.low.allFinite() || !part.box.high.allFinite()) return "a part";
  for (const client::Tear& tear : layout.torn)
    if (!std::isfinite(tear.metres) || !std::isfinite(tear.degrees) || !std::isfinite(tear.sigmas)) return "a tear";
  return {};
}

Status io_error(const std::string& what, const std::string& path) {
  return {Reason::IO_ERROR, what + " " + path + ": " + std::strerror(errno)};
}

}  // namespace

Bytes encode_layout(const MapLayout& layout) {
  ByteWriter out;
  out.reserve(kHeader + 256 + kPointBytes * layout.points.size() + kRunBytes * layout.runs.size() +
              kClosureBytes * layout.closures.size());
  out.put_bytes(as_bytes(kMagic));
  out.put(kLayoutFormat);
  out.put(std::uint32_t{0});
  out.put(std::uint64_t{0});
  put_all(out, layout);
  out.patch(kMagic.size() + 4, crc32c(ByteSpan(out.bytes()).subspan(kHeader)));
  out.patch(kMagic.size() + 8, static_cast<std::uint64_t>(out.size() - kHeader));
  return out.take();
}

Result<MapLayout> decode_layout(ByteSpan bytes) {
  ByteReader header(bytes);
  const ByteSpan magic = header.get_bytes(kMagic.size());
  if (!header.ok() || std::memcmp(magic.data(), kMagic.data(), kMagic.size()) != 0)
    return {Reason::CORRUPT, "this is no layout"};
  if (const auto format = header.get<std::uint32_t>(); header.ok() && format != kLayoutFormat)
    return {Reason::UNSUPPORTED, "a layout of format " + std::to_string(format) + "; this program reads format " +
                                     std::to_string(kLayoutFormat)};
  const auto crc = header.get<std::uint32_t>();
  const auto size = header.get<std::uint64_t>();
  if (!header.ok() || size != header.remaining()) return {Reason::CORRUPT, "the layout is cut off"};
  const ByteSpan payload = bytes.subspan(kHeader);
  if (crc32c(payload) != crc) return {Reason::CORRUPT, "the layout's checksum is wrong"};
  MapLayout layout;
  ByteReader in(payload);
  get_all(in, layout);
  if (!in.at_end()) return {Reason::CORRUPT, "the layout does not end where it should"};
  if (const std::string wrong = wrong_with(layout); !wrong.empty())
    return {Reason::CORRUPT, "the layout contradicts itself: " + wrong};
  return layout;
}

std::string layout_file(const std::string& folder, const MapIdentity& map) {
  return folder + "/" + map.uuid.to_string() + "-" + std::to_string(map.epoch) + ".layout";
}

Status save_layout(const std::string& folder, const MapLayout& layout) {
  std::error_code failed;
  if (fs::create_directories(folder, failed); failed)
    return {Reason::IO_ERROR, "make the folder " + folder + ": " + failed.message()};
  const std::string path = layout_file(folder, layout.map), temporary = path + ".new";
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) return io_error("create", temporary);
  const Bytes bytes = encode_layout(layout);
  Status status;
  for (std::size_t done = 0; done < bytes.size() && status.ok();) {
    const ::ssize_t written = ::write(file, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      status = io_error("write to", temporary);
    else
      done += static_cast<std::size_t>(written);
  }
  if (status.ok() && ::fsync(file) != 0) status = io_error("write to", temporary);
  ::close(file);
  if (status.ok() && ::rename(temporary.c_str(), path.c_str()) != 0) status = io_error("rename", temporary);
  if (!status.ok()) ::unlink(temporary.c_str());
  return status;
}

Result<MapLayout> load_layout(const std::string& folder, const MapIdentity& map) {
  const std::string path = layout_file(folder, map);
  std::ifstream in(path, std::ios::binary);
  if (!in && !fs::exists(path)) return {Reason::NO_SUCH_FILE, path};
  const Bytes bytes{std::istreambuf_iterator<char>(in), {}};
  if (!in) return {Reason::IO_ERROR, "cannot read " + path};
  auto layout = decode_layout(bytes);
  if (!layout.ok()) return {layout.reason(), path + ": " + layout.status().message()};
  if (!(layout->map == map)) return {Reason::CORRUPT, path + " is the layout of another map"};
  return layout;
}

}  // namespace relmap::console
