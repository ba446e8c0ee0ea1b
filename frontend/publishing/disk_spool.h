// A spool on disk. It survives a crash of its process and, except for the record that was being written, of the
// machine.
//
// Its folder holds `lock`, `session` (the header with the uuid), `recording` (one line that identifies the source),
// `map` (one line with uuid and epoch of the map that the session is in), `unrepeatable` (an empty file, present if the
// source cannot be read again with the same result) and numbered segments. A segment is a sequence of checksummed
// records (keyframe, gap). Records are only ever appended; a segment is deleted when none of its records is needed any
// more.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>

#include "frontend/publishing/spool.h"

namespace relmap::publishing {

class DiskSpool final : public Spool {
 public:
  // Opens the spool in `folder`, or creates one for `header`, in which a nil uuid is replaced by a random one.
  // `recording` is one line that identifies the source of the session; empty if it is not known. FOLDER_LOCKED,
  // IO_ERROR, CORRUPT (its header); CALIBRATION_CHANGED or INVALID_ARGUMENT if it belongs to another session or
  // recording and ever held anything. Damaged records at the end of a segment are dropped.
  static Result<std::unique_ptr<DiskSpool>> open(const std::string& folder, SessionHeader header,
                                                 const std::string& recording = {});
  ~DiskSpool() override;

  // Deletes the spooled keyframes and the file `map`, so that the session starts over. The server's map does not
  // change. The session keeps its uuid, so that a map does not take the same keyframes twice. An unrepeatable session
  // gets a new uuid, since a map that has a part of it would otherwise get keyframes of another run behind that part.
  // IO_ERROR.
  Status begin_anew();

  std::size_t damaged_bytes() const { return damaged_bytes_; }  // dropped by open()
  std::uint64_t disk_bytes() const;

  // Their changes are on disk when they return.
  Status set_map(const MapIdentity& map) override;
  Status mark_unrepeatable() override;
  Status append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) override;
  Status append_gap(const Gap& gap) override;
  Result<Bytes> read(std::uint32_t sequence) const override;
  Status remove_below(std::uint64_t sequence) override;

 private:
  struct Segment {
    std::uint64_t bytes = 0;
    std::uint64_t end = 0;  // 1 + the highest sequence in it
  };
  struct Place {
    std::uint32_t segment = 0;
    std::uint64_t offset = 0;
  };

  DiskSpool(std::string folder, int lock) : folder_(std::move(folder)), lock_(lock) {}
  Status load_session(SessionHeader header);
  Status load_recording(const std::string& recording);
  Status load_map();
  Status forget(std::initializer_list<const char*> names);
  Status find_segments();
  Status load_segment(std::uint32_t number);
  Status open_segment();
  Status append_record(ByteSpan head, ByteSpan body, std::uint64_t end);
  std::string segment_path(std::uint32_t number) const;

  const std::string folder_;
  const int lock_;  // file descriptor
  std::map<std::uint32_t, Segment> segments_;
  std::map<std::uint32_t, Place> places_;  // where each keyframe's payload is, by sequence
  int file_ = -1;                          // the last segment, open for appending
  std::size_t damaged_bytes_ = 0;
  bool unrepeatable_ = false;
};

}  // namespace relmap::publishing
