#include <algorithm>
#include <cstdio>
#include <utility>

#include "frontend/capture/contents_checksum.h"
#include "frontend/capture/raw_log_reader.h"
#include "frontend/capture/stereo_source.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"

namespace relmap::capture {

namespace {

std::string camera_text(const RawLogHeader& header) {
  std::string text;
  for (const std::string* name : {&header.vendor, &header.model, &header.serial})
    if (!name->empty()) text += (text.empty() ? "" : " ") + *name;
  return text;
}

// Anything unusual about the log, for describe().
std::string troubles_of(const RawLogReader& log) {
  std::uint64_t faults = 0, lost = 0, damages = 0, first_damage = 0;
  for (const RawLogEntry& entry : log.index()) {
    if (entry.kind == raw_log::Kind::kEvent) {
      ++faults;
      lost += entry.number;
    } else if (entry.kind == RawLogEntry::kDamage && damages++ == 0) {
      first_damage = entry.offset;
    }
  }
  std::string text;
  if (faults > 0)
    text += "; " + raw_log::plural(faults, "fault") + ", " + raw_log::plural(lost, "frame") + " lost by them";
  if (damages > 0)
    text += "; damaged in " + raw_log::plural(damages, "place") + ", the first at byte " + std::to_string(first_damage);
  if (log.torn_bytes() > 0)
    text += "; torn: the last " + raw_log::plural(log.torn_bytes(), "byte") + " are no whole record";
  return text;
}

// The number of frames that the camera sent and the log lacks, from gaps in their numbers or from the faults. A camera
// that was restarted counts from the beginning.
std::uint64_t lost_frames(const RawLogReader& log) {
  std::uint64_t told = 0, gaps = 0;
  std::optional<std::uint64_t> last;
  for (const RawLogEntry& entry : log.index()) {
    if (entry.kind == raw_log::Kind::kEvent) told += entry.number;
    if (entry.kind != raw_log::Kind::kFrame) continue;
    if (last && entry.number > *last) gaps += entry.number - *last - 1;
    last = entry.number;
  }
  return std::max(told, gaps);
}

class RawLogSource : public StereoSource {
 public:
  RawLogSource(RawLogReader log, const StereoCalibration& calibration, vision::Rectifier rectifier,
               std::string fingerprint)
      : log_(std::move(log)),
        calibration_(calibration),
        rectifier_(std::move(rectifier)),
        fingerprint_(std::move(fingerprint)),
        lost_(lost_frames(log_)) {}

  const StereoCalibration& calibration() const override { return calibration_; }
  const vision::Rectifier& rectifier() const override { return rectifier_; }
  std::string imu() const override { return {}; }
  std::size_t count() const override { return log_.frames(); }
  std::size_t skipped() const override { return 0; }
  std::size_t expected() const override { return count() + lost_; }
  MissingPictures missing() const override {
    MissingPictures missing;
    missing.count = lost_;
    for (std::size_t i = 0; i < log_.index().size() && missing.first.size() < MissingPictures::kNamed; ++i)
      if (const RawLogEntry& entry = log_.index()[i];
          entry.kind == RawLogEntry::kDamage || (entry.kind == raw_log::Kind::kEvent && entry.number > 0))
        missing.first.push_back("frames at byte " + std::to_string(entry.offset) + " of " + log_.path());
    return missing;
  }
  std::string describe() const override {
    const StereoLayout& layout = log_.header().layout;
    std::string text = "raw log " + log_.path() + ": " + raw_log::plural(count(), "pair") + " of " +
                       std::to_string(layout.width) + " x " + std::to_string(layout.height);
    if (const std::string camera = camera_text(log_.header()); !camera.empty()) text += " by " + camera;
    if (!rectifier_.passes_through()) text += ", to be rectified";
    return text + troubles_of(log_);
  }
  std::string fingerprint() const override { return fingerprint_; }
  std::uint32_t contents() const override {
    ContentsChecksum checksum;
    for (const RawLogEntry& entry : log_.index()) {
      checksum.add(std::int64_t{static_cast<int>(entry.kind)});
      checksum.add(static_cast<std::int64_t>(entry.number));
      checksum.add(entry.time_us);
    }
    return checksum.value();
  }
  bool stamps_rise() const override {
    for (std::size_t i = 1; i < log_.frames(); ++i)
      if (log_.time_us(i) < log_.time_us(i - 1)) return false;
    return true;
  }
  void skip_before(std::int64_t time_us) override { log_.skip_before(time_us); }

  Result<std::optional<StereoFrame>> next() override {
    const auto record = log_.next();
    if (!record.ok()) return record.status();
    if (!*record) return std::optional<StereoFrame>();
    if (const auto* event = std::get_if<RawLogEvent>(&**record)) return status_of(*event);
    const auto& logged = std::get<RawLogReader::Frame>(**record);
    StereoFrame frame;
    frame.time_us = logged.frame.time_us;
    frame.index = logged.number;
    frame.picture = "frame " + std::to_string(logged.frame.index);
    if (Status status = unpack(log_.header().layout, logged.raw, frame.left, frame.right); !status.ok()) return status;
    return std::optional<StereoFrame>(std::move(frame));
  }

 private:
  Status status_of(const RawLogEvent& event) const {
    std::string text = log_.path() + ": " + event.message;
    if (event.lost > 0) text += " (" + raw_log::plural(event.lost, "frame") + " lost)";
    return {event.reason, std::move(text)};
  }

  RawLogReader log_;
  StereoCalibration calibration_;
  vision::Rectifier rectifier_;
  std::string fingerprint_;
  std::uint64_t lost_;  // frames
};

// Made from the first frame that can be read. Rewinds the log.
Result<std::string> fingerprint_of(RawLogReader& log) {
  Status first(Reason::NO_SUCH_FILE, log.path() + " holds no frame");
  for (std::size_t i = 0; i < log.frames(); ++i) {
    log.seek(i);
    const auto record = log.next();
    if (!record.ok()) {
      if (i == 0) first = record.status();
      continue;
    }
    const auto& frame = std::get<RawLogReader::Frame>(**record);
    log.rewind();
    return "raw frames from " + std::to_string(frame.frame.time_us) + " us on, the first of checksum " +
           hex(crc32c(frame.raw));
  }
  return first;
}

}  // namespace

Result<std::unique_ptr<StereoSource>> open_raw_log(const std::string& path, const FolderOptions& options) {
  auto log = RawLogReader::open(path);
  if (!log.ok()) return log.status();
  const RawLogHeader& header = log->header();
  if (options.calibration.empty() && !header.calibration)
    return {Reason::NO_CALIBRATION, path + " holds no calibration; --calibration FILE names one"};
  const auto calibration = options.calibration.empty() ? Result<StereoCalibration>(*header.calibration)
                                                       : load_calibration(options.calibration);
  if (!calibration.ok()) return calibration.status();
  const std::string from = options.calibration.empty() ? "the log's own calibration" : options.calibration;
  if (calibration->mono()) return {Reason::NOT_STEREO, from + " is that of one camera, but " + path + " has two eyes"};
  auto rectifier = vision::Rectifier::make(*calibration, header.layout.width, header.layout.height);
  if (!rectifier.ok()) return {rectifier.reason(), from + ", for " + path + ": " + rectifier.status().message()};
  auto fingerprint = fingerprint_of(*log);
  if (!fingerprint.ok()) return fingerprint.status();
  StereoCalibration sized = *calibration;
  sized.width = header.layout.width;
  sized.height = header.layout.height;
  return std::unique_ptr<StereoSource>(
      std::make_unique<RawLogSource>(std::move(*log), sized, std::move(*rectifier), std::move(*fingerprint)));
}

}  // namespace relmap::capture
