#include "storage/migrate/facts.h"

#include <optional>
#include <string>

#include "proto/base/crc32c.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/graph/precision.h"
#include "storage/migrate/format1.h"

namespace relmap::storage {

namespace {

[[noreturn]] void lost(const std::string& what) { throw StatusError(Status(Reason::DATA_LOSS, what)); }

template <typename Value>
Value whole(std::optional<Value> value, const std::string& what) {
  if (!value) lost(what + ": malformed record");
  return std::move(*value);
}

// Each fact adds its own number, so that it does not matter in which order they come, or in which container.
class Facts {
 public:
  explicit Facts(int format) : format_(format) {}

  void add(std::string_view name, ByteSpan bytes) {
    sums_.hash += detail::mix((std::uint64_t{crc32c(as_bytes(name))} << 32 | crc32c(bytes)) + bytes.size());
  }

  void add_part(const keys::PartKey& key, ByteSpan value) {
    const std::string what = std::string(part_name(key.part)) + " part of chunk " + key.chunk.to_string();
    const auto reader =
        PartReader::open(value, key.part, key.chunk, format_ == 1 ? format1::kPartVersion : kPartVersion);
    if (!reader.ok()) lost(what + ": " + reader.status().to_string());
    for (std::size_t i = 0; i < reader->size(); ++i) {
      const auto body = reader->body(i);
      if (!body.ok()) lost(what + ": " + body.status().to_string());
      const FrameId id = frame_in(key.chunk, reader->slot(i));
      ByteWriter w;
      add_frame_part(key.part, id, *body, what, w);
      const Bytes bytes = w.take();
      if (!bytes.empty()) add(std::string(part_name(key.part)) + id.to_string(), bytes);
    }
  }

  void add_session(ByteSpan value) {
    ++sums_.sessions;
    if (format_ != 1) return add("session", encode_session(decode_session(value).or_throw()));
    const format1::SessionRecord record = format1::decode_session(value).or_throw();
    add("session", encode_session(record.session));
    for (const Skipped& item : record.skipped) add_skipped(record.session.number, item);
  }

  void add_state(ByteSpan value) {
    MapState state = format_ == 1 ? format1::decode_state(value).or_throw() : decode_state(value).or_throw();
    state.digests_commit = 0;  // digests follow from frames
    state.digests_made = {};
    add("state", encode_state(state));
  }

  void add_skipped(SessionNumber session, const Skipped& item) {
    add("skipped" + std::to_string(session), encode_skipped(item));
  }

  void add_record(std::uint64_t sequence, ByteSpan record) {
    ++sums_.journal_records;
    add("record" + std::to_string(sequence), record);
  }

  const MapFactSums& sums() const { return sums_; }

 private:
  // Writes a frame's part as today's format has it, without what is derived; nothing if that stores nothing for it.
  void add_frame_part(Part part, FrameId id, ByteSpan body, const std::string& what, ByteWriter& w) {
    switch (part) {
      case Part::kHot: {
        FrameHot hot = whole(format_ == 1 ? format1::decode_hot(body) : decode_hot(body, id), what);
        round_estimates(hot);
        if (!hot.present) return;
        ++sums_.frames;
        sums_.edges += hot.edges.size();
        sums_.landmarks += hot.landmarks.size();
        sums_.labels += hot.labels.size();
        strip_derived(hot);
        return encode_hot(w, id, hot);
      }
      case Part::kWarm: {
        const FrameWarm warm = whole(format_ == 1 ? format1::decode_warm(body) : decode_warm(body, id), what);
        sums_.observations += warm.observations.size();
        return encode_warm(w, id, warm);
      }
      case Part::kCold: {
        const FrameCold cold = whole(format_ == 1 ? format1::decode_cold(body) : decode_cold(body), what);
        sums_.features += cold.appearance.size();
        if (!cold.appearance.empty() || !cold.picture.empty()) encode_cold(w, cold);
        return;
      }
      case Part::kWords:
        if (const auto words = whole(format_ == 1 ? format1::decode_words(body) : decode_words(body), what);
            !words.empty())
          encode_words(w, words);
        return;
    }
  }

  static void strip_derived(FrameHot& hot) {
    for (Edge& edge : hot.edges) {
      edge.prior_active = false;
      edge.support = 0;
      edge.bound = 0;
      edge.carried_by.clear();
    }
    hot.incoming.clear();
    hot.unreached.clear();
    for (Landmark& landmark : hot.landmarks) {
      landmark.depth_prior = false;
      landmark.observers.clear();
    }
  }

  const int format_;
  MapFactSums sums_;
};

}  // namespace

Result<MapFactSums> sum_facts(const Engine& engine, int format,
                              const std::function<Status(std::uint64_t frames)>& progress) try {
  Facts facts(format);
  throw_if(engine.snapshot()->scan("", [&](std::string_view key, ByteSpan value) {
    if (const auto part = keys::part_of(key)) {
      facts.add_part(*part, value);
      if (part->part == Part::kHot && progress) throw_if(progress(facts.sums().frames));
    } else if (key == keys::map_state()) {
      facts.add_state(value);
    } else if (key.starts_with(keys::all_sessions())) {
      facts.add_session(value);
    } else if (key.starts_with(keys::all_skipped())) {
      const auto item = decode_skipped(value).or_throw();
      SessionNumber session = 0;
      for (const char byte : key.substr(1, sizeof session)) session = session << 8 | static_cast<std::uint8_t>(byte);
      facts.add_skipped(session, item);
    } else if (!key.starts_with(keys::all_pending()) && !key.starts_with(keys::all_events()) &&
               !key.starts_with(keys::all_digests())) {
      facts.add(key, value);
    }
    return true;
  }));
  throw_if(engine.read_journal(engine.applied_sequence() + 1, [&](std::uint64_t sequence, ByteSpan record) {
    facts.add_record(sequence, record);
    return true;
  }));
  return facts.sums();
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
