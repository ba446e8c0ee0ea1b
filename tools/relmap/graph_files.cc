#include "tools/relmap/graph_files.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ostream>
#include <set>

#include "proto/base/json.h"
#include "proto/base/number_text.h"
#include "proto/base/printf_text.h"
#include "tools/relmap/degrees.h"

namespace relmap::cli {

namespace {

constexpr double kEarthRadius = 6'378'137, kFlattening = 1 / 298.257223563;  // WGS 84

// On one line, whatever the name of a session holds.
std::string on_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return text;
}

void write_comments(const std::vector<std::string>& lines, const char* prefix, std::ostream& out) {
  for (const std::string& line : lines) out << prefix << line << '\n';
}

std::string session_text(const RelaxedMap& map, SessionNumber session) {
  return std::to_string(session) + " (" + on_one_line(map.name(session)) + ")";
}

const char* kind_of(client::EdgeKind kind) {
  switch (kind) {
    case client::EdgeKind::kLoop:
      return "loop";
    case client::EdgeKind::kPrior:
      return "prior";
    case client::EdgeKind::kOdometry:
      break;
  }
  return "odometry";
}

// Numbers of a part's frames, in its order.
std::unordered_map<FrameId, std::size_t> numbers_of(const MapPart& part) {
  std::unordered_map<FrameId, std::size_t> numbers;
  for (const PlacedFrame& placed : part.frames) numbers.emplace(placed.frame, numbers.size());
  return numbers;
}

struct Rgb {
  int red, green, blue;
};
// Okabe and Ito's.
Rgb session_colour(SessionNumber session) {
  static constexpr Rgb kColours[] = {{0, 114, 178},  {230, 159, 0}, {0, 158, 115},  {204, 121, 167},
                                     {86, 180, 233}, {213, 94, 0},  {240, 228, 66}, {90, 90, 90}};
  return kColours[(session - 1) % std::size(kColours)];
}

// East and north of the root on a plane that touches the Earth there, to degrees.
class Plane {
 public:
  explicit Plane(const Geodetic& root) : root_(root) {
    const double sine = std::sin(root.latitude / kDegrees), e2 = kFlattening * (2 - kFlattening);
    const double w = std::sqrt(1 - e2 * sine * sine);
    metres_north_ = kEarthRadius * (1 - e2) / (w * w * w) / kDegrees;
    metres_east_ = kEarthRadius / w * std::cos(root.latitude / kDegrees) / kDegrees;
  }
  std::string point(const Vector3& p) const {
    const double c = std::cos(root_.heading / kDegrees), s = std::sin(root_.heading / kDegrees);
    const double east = c * p.x() + s * p.z(), north = c * p.z() - s * p.x();
    std::string text =
        printf_text("[%.9f,%.9f", root_.longitude + east / metres_east_, root_.latitude + north / metres_north_);
    if (root_.altitude) text += printf_text(",%.3f", *root_.altitude - p.y());
    return text + ']';
  }

 private:
  const Geodetic root_;
  double metres_north_, metres_east_;  // in a degree
};

// The features of a part, with coordinates if its place is known.
class Features {
 public:
  Features(const MapPart& part, const std::optional<Geodetic>& place) : part_(part) {
    if (place) plane_.emplace(*place);
  }

  void add(const std::vector<FrameId>& frames, Json properties) {
    Json feature;
    feature.add("type", "Feature");
    if (plane_) {
      feature.add("geometry", geometry(frames));
    } else {
      feature.add_null("geometry");
      properties.add_json("metresInRoot", '[' + points(frames) + ']');
    }
    text_ += (text_.empty() ? "\n" : ",\n") + feature.add("properties", properties).text();
  }
  // A JSON list, one line a feature.
  std::string text() const { return '[' + text_ + "\n]"; }

 private:
  Json geometry(const std::vector<FrameId>& frames) const {
    if (frames.size() == 1) return Json().add("type", "Point").add_json("coordinates", points(frames));
    return Json().add("type", "LineString").add_json("coordinates", '[' + points(frames) + ']');
  }
  std::string points(const std::vector<FrameId>& frames) const {
    std::string text;
    for (const FrameId frame : frames) {
      const Vector3& p = part_.find(frame)->t;
      text += text.empty() ? "" : ",";
      text += plane_ ? plane_->point(p) : printf_text("[%.4f,%.4f,%.4f]", p.x(), p.y(), p.z());
    }
    return text;
  }

  const MapPart& part_;
  std::optional<Plane> plane_;
  std::string text_;
};

std::vector<Json> tears_json(const std::vector<client::Tear>& tears) {
  std::vector<Json> list;
  for (const client::Tear& tear : tears)
    list.push_back(Json()
                       .add("edge", tear.edge.to_string())
                       .add("metres", tear.metres, 4)
                       .add("degrees", tear.degrees, 3)
                       .add("sigmas", tear.sigmas, 2));
  return list;
}

Json step_json(const DoubtfulStep& step) {
  Json json;
  json.add("edge", step.edge.to_string());
  if (step.carried_by.empty()) {
    json.add("guess", step.guess).add("sigma", step.sigma_m, 3);
  } else {
    std::vector<std::string> carried_by;
    for (const EdgeId id : step.carried_by) carried_by.push_back(id.to_string());
    json.add("carriedBy", carried_by);
  }
  return json.add("beside", name_of(step.beside));
}

std::vector<Json> steps_json(const std::vector<DoubtfulStep>& steps) {
  std::vector<Json> list;
  for (const DoubtfulStep& step : steps) list.push_back(step_json(step));
  return list;
}

std::vector<std::string> roots_of(const RelaxedMap& map) {
  std::vector<std::string> roots;
  for (const MapPart& part : map.parts) roots.push_back(part.root.to_string());
  return roots;
}

}  // namespace

std::vector<std::string> description(const RelaxedMap& map, std::size_t number) {
  const MapPart& part = map.parts.at(number);
  std::vector<std::string> lines;
  std::string first = "relmap: the map's graph, relaxed";
  if (map.parts.size() > 1)
    first += "; part " + std::to_string(number + 1) + " of " + std::to_string(map.parts.size()) +
             ". The parts are not connected: how they lie to each other is not known";
  lines.push_back(first);
  lines.push_back("root " + part.root.to_string() + " (" + on_one_line(map.name(part.root.session)) +
                  "): poses are in its camera's frame (x right, y down, z forward); metres");
  std::string sessions;
  for (const SessionNumber session : part.sessions())
    sessions += (sessions.empty() ? "" : ", ") + session_text(map, session);
  lines.push_back(counted_text(part.frames.size(), "frame") + " of session " + sessions);
  for (const client::Tear& tear : part.tears) lines.push_back("tear " + tear.words());
  for (const DoubtfulStep& step : part.doubtful)
    lines.push_back((step.carried_by.empty() ? "not measured: " : "carried: ") + step.words());
  return lines;
}

std::vector<std::string> numbering(const MapPart& part, std::size_t first) {
  std::vector<std::string> runs;
  for (std::size_t begin = 0, i = 1; i <= part.frames.size(); ++i) {
    const FrameId last = part.frames[i - 1].frame;
    if (i < part.frames.size() && part.frames[i].frame == FrameId{last.session, last.index + 1}) continue;
    runs.push_back(std::to_string(first + begin) + " to " + std::to_string(first + i - 1) + ": frames " +
                   part.frames[begin].frame.to_string() + " to " + last.to_string());
    begin = i;
  }
  return runs;
}

std::size_t write_tum(const RelaxedMap& map, std::size_t number, const FrameTimes& times, std::ostream& out) {
  const MapPart& part = map.parts.at(number);
  write_comments(description(map, number), "# ", out);
  SessionNumber session = 0;
  std::size_t left_out = 0;
  for (const PlacedFrame& placed : part.frames) {
    const auto time = times.find(placed.frame);
    if (time == times.end()) {
      ++left_out;
      continue;
    }
    if (placed.frame.session != session)
      out << "# session " << session_text(map, session = placed.frame.session)
          << ": time (UTC, seconds) tx ty tz qx qy qz qw\n";
    const Vector3& t = placed.T_root_frame.t;
    const Eigen::Quaterniond q = placed.T_root_frame.quaternion();
    const auto us = static_cast<long long>(time->second);
    out << printf_text("%lld.%06lld %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", us / 1000000, us % 1000000, t.x(), t.y(),
                       t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return left_out;
}

void write_kitti(const MapPart& part, std::ostream& out) {
  for (const PlacedFrame& placed : part.frames) {
    const Matrix3& R = placed.T_root_frame.R;
    const Vector3& t = placed.T_root_frame.t;
    out << printf_text("%.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", R(0, 0), R(0, 1), R(0, 2),
                       t.x(), R(1, 0), R(1, 1), R(1, 2), t.y(), R(2, 0), R(2, 1), R(2, 2), t.z());
  }
}

void write_g2o(const RelaxedMap& map, std::size_t number, std::ostream& out) {
  const MapPart& part = map.parts.at(number);
  write_comments(description(map, number), "# ", out);
  write_comments(numbering(part, 0), "# vertices ", out);
  const auto numbers = numbers_of(part);
  for (const PlacedFrame& placed : part.frames) {
    const Vector3& t = placed.T_root_frame.t;
    const Eigen::Quaterniond q = placed.T_root_frame.quaternion();
    out << printf_text("VERTEX_SE3:QUAT %zu %.12g %.12g %.12g %.15g %.15g %.15g %.15g\n", numbers.at(placed.frame),
                       t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  out << "FIX " << numbers.at(part.root) << '\n';
  Vector6 scale;  // a small rotation is twice the vector part of its quaternion
  scale << 1, 1, 1, 2, 2, 2;
  for (const std::size_t spring : part.edges) {
    if (!map.springs[spring].pulls) continue;
    const client::RelaxationEdge& edge = map.springs[spring].relaxed;
    const Eigen::Quaterniond q = edge.T_ab.quaternion();
    std::string line =
        printf_text("EDGE_SE3:QUAT %zu %zu %.12g %.12g %.12g %.15g %.15g %.15g %.15g", numbers.at(edge.a),
                    numbers.at(edge.b), edge.T_ab.t.x(), edge.T_ab.t.y(), edge.T_ab.t.z(), q.x(), q.y(), q.z(), q.w());
    const Matrix6 information = scale.asDiagonal() * edge.covariance.inverse() * scale.asDiagonal();
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) line += printf_text(" %.12g", 0.5 * (information(i, j) + information(j, i)));
    out << line << '\n';
  }
}

void write_ply_head(const RelaxedMap& map, std::size_t number, std::uint64_t landmarks, std::ostream& out) {
  const MapPart& part = map.parts.at(number);
  out << "ply\nformat ascii 1.0\n";
  write_comments(description(map, number), "comment ", out);
  out << "comment vertices: first the frames, then " << landmarks
      << " landmarks, each with the frame in which it is stored and how many frames determine it (frames: 0)\n"
      << "element vertex " << part.frames.size() + landmarks
      << "\nproperty double x\nproperty double y\nproperty double z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\n"
         "property uint session\nproperty uint index\nproperty uint observers\n"
         "comment kind: 0 odometry, 1 prior, 2 loop; doubtful: 1 where nothing measured it, or the robot was carried\n"
      << "element edge " << part.edges.size()
      << "\nproperty uint vertex1\nproperty uint vertex2\nproperty uchar kind\nproperty uchar doubtful\nend_header\n";
  for (const PlacedFrame& placed : part.frames) {
    const Vector3& t = placed.T_root_frame.t;
    const Rgb c = session_colour(placed.frame.session);
    out << printf_text("%.6f %.6f %.6f %d %d %d %u %u 0\n", t.x(), t.y(), t.z(), c.red, c.green, c.blue,
                       placed.frame.session, placed.frame.index);
  }
}

std::string ply_landmark(FrameId base, const SE3& T_root_base, const client::ExportedFrame::Landmark& landmark) {
  const Vector3 p = T_root_base * Vector3(landmark.point.cast<double>());
  const Rgb c = session_colour(base.session);
  // Paler than the frames.
  return printf_text("%.6f %.6f %.6f %d %d %d %u %u %u\n", p.x(), p.y(), p.z(), (c.red + 255) / 2, (c.green + 255) / 2,
                     (c.blue + 255) / 2, base.session, base.index, landmark.observers);
}

void write_ply_tail(const RelaxedMap& map, std::size_t number, std::ostream& out) {
  const MapPart& part = map.parts.at(number);
  const auto numbers = numbers_of(part);
  for (const std::size_t index : part.edges) {
    const client::Spring& spring = map.springs[index];
    const int kind = spring.kind == client::EdgeKind::kLoop ? 2 : spring.kind == client::EdgeKind::kPrior ? 1 : 0;
    out << printf_text("%zu %zu %d %d\n", numbers.at(spring.relaxed.a), numbers.at(spring.relaxed.b), kind,
                       spring.doubtful ? 1 : 0);
  }
}

void write_geojson(const RelaxedMap& map, std::size_t number, const std::optional<Geodetic>& place, std::ostream& out) {
  const MapPart& part = map.parts.at(number);
  Features features(part, place);

  // Runs of frames that measured motion joins.
  std::set<std::pair<FrameId, FrameId>> joined;
  std::set<EdgeId> torn;
  for (const std::size_t index : part.edges) {
    const client::Spring& spring = map.springs[index];
    if (spring.kind != client::EdgeKind::kLoop && !spring.doubtful) joined.insert({spring.relaxed.a, spring.relaxed.b});
  }
  for (const client::Tear& tear : part.tears) torn.insert(tear.edge);
  std::vector<FrameId> run;
  const auto end_run = [&] {
    if (!run.empty())
      features.add(run, Json()
                            .add("session", run[0].session)
                            .add("name", map.name(run[0].session))
                            .add("first", run.front().to_string())
                            .add("last", run.back().to_string()));
    run.clear();
  };
  for (const PlacedFrame& placed : part.frames) {
    if (!run.empty() && !joined.contains({run.back(), placed.frame})) end_run();
    run.push_back(placed.frame);
  }
  end_run();
  for (const std::size_t index : part.edges) {
    const client::Spring& spring = map.springs[index];
    if (spring.kind == client::EdgeKind::kOdometry && !spring.doubtful) continue;
    features.add({spring.relaxed.a, spring.relaxed.b}, Json()
                                                           .add("edge", spring.edge.to_string())
                                                           .add("kind", kind_of(spring.kind))
                                                           .add("tear", torn.contains(spring.edge))
                                                           .add("doubtful", spring.doubtful));
  }
  for (const MapPart::Label& label : part.labels)
    features.add({label.frame}, Json().add("label", label.text).add("frame", label.frame.to_string()));

  const char* note = place
                         ? "the root was put where the caller said; its y axis is taken for plumb"
                         : "where the map lies on the Earth is not known: features have no geometry; metresInRoot has "
                           "their positions in the frame of the root (x right, y down, z forward)";
  out << Json()
             .add("type", "FeatureCollection")
             .add("root", part.root.to_string())
             .add("roots", roots_of(map))
             .add("part", number + 1)
             .add("parts", map.parts.size())
             .add("frames", part.frames.size())
             .add("located", place.has_value())
             .add("tears", tears_json(part.tears))
             .add("doubtful", steps_json(part.doubtful))
             .add("note", note)
             .add_json("features", features.text())
             .text()
      << '\n';
}

}  // namespace relmap::cli
