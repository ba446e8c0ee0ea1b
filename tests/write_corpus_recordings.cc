// What fuzzers of a robot's files start from: raw logs with their indexes, and files of keyframes.
#include <cstdint>
#include <string>
#include <vector>

#include "frontend/capture/raw_log_index.h"
#include "proto/base/crc32c.h"
#include "proto/calibration/calibration_samples.h"
#include "proto/keyframe/keyframe_samples.h"
#include "storage/testing/temporary_folder.h"
#include "tests/write_corpus.h"

namespace relmap::testing {

using namespace capture;
using raw_log::Kind;

namespace {

// A log and its index, as they stand in the fuzzer's inputs: one behind the other.
class LogFiles {
 public:
  LogFiles() { log_.put_bytes(raw_log::encode_begin()); }
  LogFiles& add(raw_log::Head head, ByteSpan body) {
    head.bytes = static_cast<std::uint32_t>(body.size());
    head.crc = crc32c(body);
    index_.emplace_back(head, log_.size());
    log_.put_bytes(raw_log::encode_head(head));
    log_.put_bytes(body);
    return *this;
  }
  LogFiles& header(const RawLogHeader& header) {
    return add({Kind::kHeader, Reason::OK, 0, 0, header.begun_us, 0, {}}, raw_log::encode_header(header));
  }
  LogFiles& frame(std::uint64_t number, std::size_t bytes, std::optional<std::uint32_t> cycle = {}) {
    Bytes pixels(bytes);
    for (std::size_t i = 0; i < bytes; ++i) pixels[i] = static_cast<std::uint8_t>(number + 7 * i);
    return add({Kind::kFrame, Reason::OK, 0, 0, 1000 + static_cast<std::int64_t>(number), number, cycle}, pixels);
  }
  LogFiles& event(Reason reason, std::string_view message) {
    return add({Kind::kEvent, reason, 0, 0, 999, 3, {}}, as_bytes(message));
  }
  LogFiles& bytes(ByteSpan bytes) {
    log_.put_bytes(bytes);
    return *this;
  }
  const Bytes& log() const { return log_.bytes(); }
  RawLogIndex& index() { return index_; }
  Bytes both() const {
    const storage::TemporaryFolder folder;
    {
      RawLogIndexWriter writer(folder / "idx");
      for (const RawLogEntry& entry : index_) writer.add(entry);
      fuzzing::must(writer.flush());
    }
    Bytes all = log_.bytes();
    const Bytes index = fuzzing::read_file(folder / "idx");
    all.insert(all.end(), index.begin(), index.end());
    return all;
  }

 private:
  ByteWriter log_;
  RawLogIndex index_;
};

}  // namespace

void write_raw_logs(const std::string& root) {
  const Corpus corpus(root, "raw_log_fuzz");
  for (const auto filter : {ColourFilter::kNone, ColourFilter::kGBRG})
    for (const auto first : {FirstByte::kLeft, FirstByte::kRight}) {
      RawLogHeader header;
      header.vendor = "Point Grey Research";
      header.layout = {17, 3, first, filter};
      header.rate_hz = 20;
      header.begun_us = 900;
      if (filter == ColourFilter::kNone) header.calibration = sample_raw_calibration();
      LogFiles files;
      files.header(header)
          .header(header)
          .frame(0, 102, 77)
          .event(Reason::CAMERA_STALLED, "halted")
          .frame(1, 104)
          .frame(4, 90);
      const std::string name = std::string(filter == ColourFilter::kNone ? "grey" : "colour") +
                               (first == FirstByte::kLeft ? "_left_first" : "_right_first");
      corpus.add(name, {}, files.log());
      corpus.add(name + "_with_index", {}, files.both());
      if (filter != ColourFilter::kNone || first != FirstByte::kLeft) continue;
      corpus.add("index_cut_with_log", {}, cut(files.both(), 40));
      LogFiles other = files;
      other.index().front().time_us = 1;
      corpus.add("index_of_another_log", {}, other.both());
      other = files;
      other.index().pop_back();
      corpus.add("index_of_fewer_records", {}, other.both());
      other = files;
      other.index()[3].number = 9;
      corpus.add("index_with_another_number", {}, other.both());
      other = files;
      other.event(Reason::OK, "no fault")
          .event(static_cast<Reason>(60000), "unknown")
          .add({static_cast<Kind>(9), {}, 0, 0, 5, 0, {}}, Bytes(3));
      corpus.add("events_without_reason", {}, other.both());
      other = files;
      other.bytes(Bytes(50, 1)).bytes(as_bytes("\xf5RLG")).bytes(Bytes(40, 2));
      corpus.add("torn_with_index", {}, other.both());
    }
  RawLogHeader line;  // of which no pixel has a neighbour below it
  line.layout = {4, 1, FirstByte::kLeft, ColourFilter::kBGGR};
  corpus.add("one_line_of_colours", {}, LogFiles().header(line).frame(0, 8).log());
  RawLogHeader nothing;
  corpus.add("no_size", {}, LogFiles().header(nothing).header(nothing).log());
  RawLogHeader wrong = line;
  wrong.layout.filter = static_cast<ColourFilter>(9);
  corpus.add("of_no_camera", {}, LogFiles().header(wrong).log());
  corpus.add("body_of_nothing", {}, LogFiles().add({Kind::kHeader, {}, 0, 0, 0, 0, {}}, Bytes(3)).frame(0, 8).log());
}

void write_keyframe_files(const std::string& root) {
  const Corpus corpus(root, "keyframe_file_fuzz");
  ByteWriter w;
  for (const std::uint64_t seed : {7, 8}) {
    Keyframe keyframe = sample_keyframe(seed);
    keyframe.tracks.clear();
    keyframe.appearance.resize(1);
    keyframe.appearance[0].track = -1;
    const Bytes bytes = encode_keyframe(keyframe);
    w.put(static_cast<std::uint32_t>(bytes.size()));
    w.put_bytes(bytes);
  }
  const Bytes sound = w.bytes();
  corpus.add("sound", {}, sound);
  corpus.add("empty", {});
  corpus.add("cut", {}, cut(sound, 9));
  corpus.add("cut_in_length", {}, ByteSpan(sound).first(3));
  Bytes changed = sound;
  changed[0] ^= 1;
  corpus.add("other_length", {}, changed);
  changed = sound;
  changed[3] = 0x7f;
  corpus.add("length_too_large", {}, changed);
  changed = sound;
  changed[5] ^= 1;
  corpus.add("no_keyframe", {}, changed);
  changed = sound;
  changed[8] = 9;
  corpus.add("other_version", {}, changed);
}

}  // namespace relmap::testing
