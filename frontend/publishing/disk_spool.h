// A spool on disk. Survives the death of its process and, but for what was being written, that of the machine.
//
// A folder holds `lock`, `session` (the header, uuid included), `recording` (what it is made of), `map` (the one that
// the session is in: its uuid and epoch, a line), `unrepeatable` (empty, where it is) and numbered segments, each a row
// of checksummed records (keyframe, gap). Records are only ever appended; a segment is deleted when nothing in it is
// wanted any more.
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
  // Begins a spool for `header` (a nil uuid becomes a random one), or opens the one in `folder`. `recording`: one line
  // that tells what the session is made of from anything else it might be; empty: not said. FOLDER_LOCKED, IO_ERROR,
  // CORRUPT (its header); CALIBRATION_CHANGED or INVALID_ARGUMENT if it belongs to another session or recording and
  // ever held anything. Records damaged at the end of a segment are dropped.
  static Result<std::unique_ptr<DiskSpool>> open(const std::string& folder, SessionHeader header,
                                                 const std::string& recording = {});
  ~DiskSpool() override;

  // Forgets the keyframes and the map: the session is begun anew. Under its uuid, so that what a map has of it is not
  // taken in twice; but where it is unrepeatable under another, since a map that has part of it would get keyframes of
  // another run behind those that it has. IO_ERROR.
  Status begin_anew();

  std::size_t damaged_bytes() const { return damaged_bytes_; }  // dropped by open()
  std::uint64_t disk_bytes() const;

  // On disk when they return.
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
  std::map<std::uint32_t, Place> places_;  // of the keyframes
  int file_ = -1;                          // of the last segment, open for appending
  std::size_t damaged_bytes_ = 0;
  bool unrepeatable_ = false;
};

}  // namespace relmap::publishing
