// Keyframes of one session on disk until the daemon has settled them. Survives the death of its process and, but for
// what was being written, that of the machine.
//
// A folder holds `lock`, `session` (the header, uuid included), `recording` (what it is made of) and numbered segments,
// each a row of checksummed records (keyframe, gap). Records are only ever appended; a segment is deleted when nothing
// in it is wanted any more. Single-threaded.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "proto/keyframe.h"

namespace relmap {

class Spool {
 public:
  struct Entry {
    std::uint32_t crc = 0;  // of the payload
    std::uint32_t bytes = 0;
    std::uint32_t segment = 0;
    std::uint64_t offset = 0;
  };

  // Begins a spool for `header` (a nil uuid becomes a random one), or opens the one in `folder`. `recording`: one line
  // that tells what the session is made of from anything else it might be; empty: not said. FOLDER_LOCKED, IO_ERROR,
  // CORRUPT (its header); CALIBRATION_CHANGED or INVALID_ARGUMENT if it belongs to another session or recording and
  // ever held anything. Records damaged at the end of a segment are dropped.
  static Result<std::unique_ptr<Spool>> open(const std::string& folder, SessionHeader header,
                                             const std::string& recording = {});
  ~Spool();

  const SessionHeader& session() const { return session_; }
  const std::map<std::uint32_t, Entry>& keyframes() const { return keyframes_; }
  const std::vector<Gap>& gaps() const { return gaps_; }        // in the order in which they were declared
  std::size_t damaged_bytes() const { return damaged_bytes_; }  // dropped by open()
  std::uint64_t disk_bytes() const;

  // On disk when they return. IO_ERROR.
  Status append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc);
  Status append_gap(const Gap& gap);

  // IO_ERROR; CORRUPT if the disk changed it.
  Result<Bytes> read(std::uint32_t sequence) const;

  // What lies below `sequence` is not wanted any more.
  Status remove_below(std::uint64_t sequence);

 private:
  struct Segment {
    std::uint64_t bytes = 0;
    std::uint64_t end = 0;  // 1 + the highest sequence in it
  };

  Spool(std::string folder, int lock) : folder_(std::move(folder)), lock_(lock) {}
  Status load_session(SessionHeader header);
  Status load_recording(const std::string& recording);
  Status find_segments();
  Status load_segment(std::uint32_t number);
  Status open_segment();
  Status append_record(ByteSpan head, ByteSpan body, std::uint64_t end);
  std::string segment_path(std::uint32_t number) const;

  const std::string folder_;
  const int lock_;  // file descriptor
  SessionHeader session_;
  std::map<std::uint32_t, Segment> segments_;
  std::map<std::uint32_t, Entry> keyframes_;
  std::vector<Gap> gaps_;
  int file_ = -1;  // of the last segment, open for appending
  std::size_t damaged_bytes_ = 0;
};

}  // namespace relmap
