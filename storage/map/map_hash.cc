#include <algorithm>
#include <bit>
#include <string_view>
#include <unordered_map>

#include "proto/base/crc32c.h"
#include "proto/keyframe/extension_codec.h"
#include "storage/format/extension_tags.h"
#include "storage/graph/precision.h"
#include "storage/map/map.h"

namespace relmap::storage {
namespace {

// Order matters in mix(); what must not depend on the order of session numbers is added up instead.
class Hash {
 public:
  explicit Hash(std::uint64_t seed) : state_(seed) {}
  Hash& mix(std::uint64_t value) {
    state_ = detail::mix(state_ * 0x9e3779b97f4a7c15ULL + value + 1);
    return *this;
  }
  Hash& mix(double value) { return mix(std::bit_cast<std::uint64_t>(value)); }
  Hash& mix(float value) { return mix(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
  Hash& mix(const double* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) mix(values[i]);
    return *this;
  }
  Hash& mix(const SE3& T) { return mix(T.R.data(), 9).mix(T.t.data(), 3); }
  Hash& mix(std::string_view text) {
    return mix(std::uint64_t{crc32c(as_bytes(text))}).mix(std::uint64_t{text.size()});
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_;
};

template <typename Enum>
std::uint64_t number(Enum value) {
  return static_cast<std::uint64_t>(value);
}

class MapHasher {
 public:
  explicit MapHasher(const Graph& graph) : graph_(graph) {}

  MapHash run() {
    std::vector<Session> sessions = graph_.sessions();
    std::sort(sessions.begin(), sessions.end(),
              [](const Session& l, const Session& r) { return l.header.uuid < r.header.uuid; });
    for (const Session& session : sessions) uuid_[session.number] = std::hash<SessionUuid>()(session.header.uuid);
    Hash structure(1), estimates(2);
    for (const Session& session : sessions) {
      add_session(session, structure);
      if (session.frames == 0) continue;
      for (std::uint64_t index = session.first; index <= session.last; ++index) {
        const FrameId id{session.number, static_cast<std::uint32_t>(index)};
        const auto hot = graph_.hot(id);
        if (!hot) continue;
        structure.mix(key(id));
        add_structure(*hot, structure);
        add_observations(*graph_.warm(id), structure);
        add_appearance(*graph_.cold(id), structure);
        add_estimates(*hot, estimates);
      }
    }
    return {structure.value(), estimates.value()};
  }

 private:
  std::uint64_t key(FrameId id) const {
    const auto found = uuid_.find(id.session);
    return Hash(3).mix(found == uuid_.end() ? 0 : found->second).mix(std::uint64_t{id.index}).value();
  }
  std::uint64_t key(EdgeId id) const { return Hash(4).mix(key(id.frame)).mix(std::uint64_t{id.ordinal}).value(); }
  std::uint64_t key(LandmarkId id) const { return Hash(5).mix(key(id.base)).mix(std::uint64_t{id.slot}).value(); }

  // For lists that are sorted by id, or whose order does not count.
  template <typename Id>
  std::uint64_t set_of(const std::vector<Id>& ids) const {
    std::uint64_t sum = ids.size();
    for (const Id& id : ids) sum += key(id);
    return sum;
  }

  void add_session(const Session& s, Hash& h) const {
    h.mix(std::hash<SessionUuid>()(s.header.uuid)).mix(s.display_name).mix(std::uint64_t{s.first});
    h.mix(std::uint64_t{s.last}).mix(std::uint64_t{s.frames}).mix(std::uint64_t{s.next_sequence});
    add_extensions(header_extensions(s.header), h);
    add_extensions(s.unknown, h);
    graph_.visit_skipped(s.number, 0, [&](const Skipped& item) {
      h.mix(std::uint64_t{item.from}).mix(std::uint64_t{item.to}).mix(std::uint64_t{item.crc}).mix(number(item.reason));
      return true;
    });
  }

  void add_structure(const FrameHot& f, Hash& h) const {
    h.mix(static_cast<std::uint64_t>(f.time_us)).mix(std::uint64_t{f.payload_crc});
    h.mix(std::uint64_t{f.appearance_count}).mix(std::uint64_t{f.next_loop_ordinal});
    for (const Edge& e : f.edges) {
      h.mix(key(e.id)).mix(key(e.a)).mix(key(e.b)).mix(number(e.kind)).mix(number(e.state)).mix(number(e.reason));
      h.mix(number(e.source)).mix(std::uint64_t{e.carries}).mix(std::uint64_t{e.prior_active});
      h.mix(std::uint64_t{e.support}).mix(number(e.verification)).mix(std::uint64_t{e.inliers});
      h.mix(std::uint64_t{e.bound}).mix(set_of(e.bound_frames)).mix(set_of(e.consistent_with));
      if (e.carried.session != 0)
        h.mix(key(FrameId{e.carried.session, e.carried.first})).mix(std::uint64_t{e.carried.last});
      if (!e.carried_by.empty()) h.mix(set_of(e.carried_by));
      if (e.uniqueness.known) add_uniqueness(e.uniqueness, h);
      if (e.around) h.mix(key(e.around->from));
      for (const std::uint32_t index : e.unseen) h.mix(std::uint64_t{index});
      add_extensions(e.unknown, h);
    }
    h.mix(set_of(f.incoming)).mix(std::uint64_t{f.landmarks.size()});
    for (const Landmark& l : f.landmarks) {
      h.mix(std::uint64_t{l.track.sequence}).mix(std::uint64_t{l.track.index}).mix(std::uint64_t{l.depth_prior});
      for (const AliasClaim& claim : l.claims) h.mix(key(claim.target)).mix(key(claim.closure));
      h.mix(set_of(l.observers));
    }
    std::uint64_t unreached = 0;
    for (const Unreached& item : f.unreached)
      unreached += Hash(12).mix(std::uint64_t{item.slot}).mix(key(item.observer)).value();
    h.mix(std::uint64_t{f.unreached.size()}).mix(unreached);
    for (const std::string& label : f.labels) h.mix(label);
    add_extensions(f.unknown, h);
  }

  void add_uniqueness(const Uniqueness& u, Hash& h) const {
    h.mix(key(u.runner_up)).mix(std::uint64_t{u.runner_up_inliers}).mix(u.runner_up_probability);
    h.mix(std::uint64_t{u.alike}).mix(u.differs).mix(std::uint64_t{u.compared}).mix(std::uint64_t{u.changed});
  }

  static void add_extensions(const Extensions& extensions, Hash& h) {
    for (const Extension& extension : extensions)
      if (tags::is_hashed(extension.tag))
        h.mix(std::uint64_t{extension.tag})
            .mix(std::uint64_t{crc32c(extension.bytes)})
            .mix(std::uint64_t{extension.bytes.size()});
  }

  void add_observations(const FrameWarm& f, Hash& h) const {
    h.mix(std::uint64_t{f.observations.size()});
    for (const Observation& o : f.observations) {
      h.mix(key(o.landmark)).mix(key(o.origin)).mix(o.u_left).mix(o.v).mix(o.u_right);
      h.mix(std::uint64_t{o.level} | std::uint64_t{o.aligned} << 8);
    }
  }

  static void add_appearance(const FrameCold& f, Hash& h) {
    for (const AppearanceFeature& a : f.appearance) {
      h.mix(a.u).mix(a.v).mix(a.disparity).mix(a.scale).mix(a.angle);
      h.mix(static_cast<std::uint64_t>(a.track)).mix(std::uint64_t{crc32c(a.descriptor)});
    }
    for (const std::uint32_t word : f.words) h.mix(std::uint64_t{word});
    h.mix(std::uint64_t{crc32c(f.picture)});
  }

  static void add_estimates(const FrameHot& f, Hash& h) {
    h.mix(f.T_odom_frame).mix(f.mean_error).mix(std::uint64_t{f.error_terms});
    for (const Edge& e : f.edges) {
      h.mix(e.T_ab).mix(e.covariance.data(), 36).mix(e.prior_T_ab).mix(e.prior_covariance.data(), 36);
      if (!is_zero(e.correlation_with_previous))
        for (const std::int8_t part : e.correlation_with_previous) h.mix(static_cast<std::uint64_t>(part));
      if (e.around) h.mix(e.around->T).mix(e.around->covariance.data(), 36);
      h.mix(e.driven_s).mix(e.standing_s).mix(e.probability).mix(e.spread);
    }
    for (const Landmark& l : f.landmarks) h.mix(l.abr.data(), 3);
  }

  const Graph& graph_;
  std::unordered_map<SessionNumber, std::uint64_t> uuid_;
};

}  // namespace

MapHash hash_map(const Graph& graph) { return MapHasher(graph).run(); }

}  // namespace relmap::storage
