#include "tools/relmap/graph_files.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <unordered_map>

#include "client/map_picture.h"

namespace relmap::cli {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kEarthRadius = 6'378'137, kFlattening = 1 / 298.257223563;  // WGS 84

[[gnu::format(printf, 2, 3)]] void print(std::string& out, const char* format, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  out += text;
}

using Poses = std::unordered_map<FrameId, SE3>;

Poses poses_side_by_side(const RelaxedMap& map) {
  Poses poses;
  for (const MapPicture::Frame& frame : side_by_side(map.relaxation)) poses.emplace(frame.id, frame.T_picture_frame);
  return poses;
}

// Each tear and each root on a line of its own, behind `prefix`.
std::string comments(const RelaxedMap& map, const std::string& prefix) {
  std::string text = prefix + "relmap: the map relaxed into one frame for each connected part; metres; camera axes " +
                     "(x right, y down, z forward)\n";
  for (const FrameId root : map.roots())
    text += prefix + "root " + root.to_string() + " (" + map.graph.names.at(root.session) + ")\n";
  for (const Tear& tear : map.tears) {
    text += prefix + "tear " + tear.edge.id.to_string() + " from " + tear.edge.a.to_string() + " to " +
            tear.edge.b.to_string();
    print(text, ": %.3f m, %.2f degrees, %.1f sigmas\n", tear.metres, tear.degrees, tear.sigmas);
  }
  return text;
}

const char* kind_of(const client::Edge& edge) {
  switch (edge.kind) {
    case client::EdgeKind::kLoop:
      return "loop";
    case client::EdgeKind::kPrior:
      return "prior";
    case client::EdgeKind::kOdometry:
      break;
  }
  return "odometry";
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20)
      print(out, "\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + '"';
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
    std::string text;
    print(text, "[%.9f,%.9f,%.3f]", root_.longitude + east / metres_east_, root_.latitude + north / metres_north_,
          -p.y());
    return text;
  }

 private:
  const Geodetic root_;
  double metres_north_, metres_east_;  // in a degree
};

}  // namespace

std::vector<FrameId> RelaxedMap::roots() const {
  std::vector<FrameId> roots(static_cast<std::size_t>(relaxation.components));
  for (const RelaxedPose& pose : relaxation.poses)
    if (FrameId& root = roots[static_cast<std::size_t>(pose.component)]; !root.valid()) root = pose.frame;
  return roots;
}

Result<RelaxedMap> relax_map(MapGraph graph, std::vector<client::LabelledFrames> labels) {
  auto relaxation = relax(graph);
  if (!relaxation.ok()) return relaxation.status();
  RelaxedMap map{std::move(graph), std::move(relaxation).value(), std::move(labels), {}};
  Poses poses;
  for (const RelaxedPose& pose : map.relaxation.poses) poses.emplace(pose.frame, pose.T_component_frame);
  for (const client::Edge& edge : map.graph.edges) {
    if (!in_graph(edge)) continue;
    const SE3 off = edge.T_ab.inverse() * (poses.at(edge.a).inverse() * poses.at(edge.b));
    const Vector6 xi = off.log();
    const double sigmas = std::sqrt(std::max(0.0, xi.dot(edge.covariance.ldlt().solve(xi))));
    if (sigmas > kTearSigmas) map.tears.push_back({edge, off.t.norm(), kDegrees * xi.tail<3>().norm(), sigmas});
  }
  std::stable_sort(map.tears.begin(), map.tears.end(),
                   [](const Tear& x, const Tear& y) { return x.sigmas > y.sigmas; });
  return map;
}

std::string to_g2o(const RelaxedMap& map) {
  std::string text = comments(map, "# ");
  std::unordered_map<FrameId, std::size_t> numbers;
  std::string vertices, fixed;
  std::vector<bool> has_root(static_cast<std::size_t>(map.relaxation.components));
  FrameId run;  // of frames of consecutive indices
  std::size_t run_begin = 0;
  const auto end_run = [&](FrameId last) {
    if (run.valid())
      text += "# vertices " + std::to_string(run_begin) + " to " + std::to_string(numbers.size() - 1) + ": frames " +
              run.to_string() + " to " + last.to_string() + "\n";
  };
  FrameId last;
  for (const RelaxedPose& pose : map.relaxation.poses) {
    const std::size_t number = numbers.size();
    if (!run.valid() || pose.frame.session != last.session || pose.frame.index != last.index + 1) {
      end_run(last);
      run = pose.frame;
      run_begin = number;
    }
    last = pose.frame;
    numbers.emplace(pose.frame, number);
    const Vector3& t = pose.T_component_frame.t;
    const Eigen::Quaterniond q = pose.T_component_frame.quaternion();
    print(vertices, "VERTEX_SE3:QUAT %zu %.12g %.12g %.12g %.15g %.15g %.15g %.15g\n", number, t.x(), t.y(), t.z(),
          q.x(), q.y(), q.z(), q.w());
    if (!has_root[static_cast<std::size_t>(pose.component)]) fixed += "FIX " + std::to_string(number) + "\n";
    has_root[static_cast<std::size_t>(pose.component)] = true;
  }
  end_run(last);
  text += vertices + fixed;
  Vector6 scale;  // a small rotation is twice the vector part of its quaternion
  scale << 1, 1, 1, 2, 2, 2;
  for (const client::Edge& edge : map.graph.edges) {
    if (!in_graph(edge)) continue;
    const Eigen::Quaterniond q = edge.T_ab.quaternion();
    print(text, "EDGE_SE3:QUAT %zu %zu %.12g %.12g %.12g %.15g %.15g %.15g %.15g", numbers.at(edge.a),
          numbers.at(edge.b), edge.T_ab.t.x(), edge.T_ab.t.y(), edge.T_ab.t.z(), q.x(), q.y(), q.z(), q.w());
    const Matrix6 information = scale.asDiagonal() * edge.covariance.inverse() * scale.asDiagonal();
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) print(text, " %.12g", 0.5 * (information(i, j) + information(j, i)));
    text += '\n';
  }
  return text;
}

std::string to_ply(const RelaxedMap& map) {
  const Poses poses = poses_side_by_side(map);
  const auto edges = static_cast<std::size_t>(std::count_if(map.graph.edges.begin(), map.graph.edges.end(), in_graph));
  std::string text = "ply\nformat ascii 1.0\n" + comments(map, "comment ");
  text += "element vertex " + std::to_string(map.relaxation.poses.size()) +
          "\nproperty double x\nproperty double y\nproperty double z\n"
          "property uchar red\nproperty uchar green\nproperty uchar blue\n"
          "property uint session\nproperty uint index\n";
  text += "comment kind: 0 odometry, 1 prior, 2 loop\nelement edge " + std::to_string(edges) +
          "\nproperty uint vertex1\nproperty uint vertex2\nproperty uchar kind\nend_header\n";
  static constexpr unsigned char kColours[][3] = {{0, 114, 178},  {230, 159, 0}, {0, 158, 115},  {204, 121, 167},
                                                  {86, 180, 233}, {213, 94, 0},  {240, 228, 66}, {90, 90, 90}};
  std::unordered_map<FrameId, std::size_t> numbers;
  for (const RelaxedPose& pose : map.relaxation.poses) {
    numbers.emplace(pose.frame, numbers.size());
    const Vector3& t = poses.at(pose.frame).t;
    const auto& colour = kColours[(pose.frame.session - 1) % std::size(kColours)];
    print(text, "%.6f %.6f %.6f %d %d %d %u %u\n", t.x(), t.y(), t.z(), colour[0], colour[1], colour[2],
          pose.frame.session, pose.frame.index);
  }
  for (const client::Edge& edge : map.graph.edges)
    if (in_graph(edge))
      print(text, "%zu %zu %d\n", numbers.at(edge.a), numbers.at(edge.b),
            edge.kind == client::EdgeKind::kLoop    ? 2
            : edge.kind == client::EdgeKind::kPrior ? 1
                                                    : 0);
  return text;
}

std::string to_geojson(const RelaxedMap& map, const Geodetic& root) {
  const Poses poses = poses_side_by_side(map);
  // The root of the largest component is where it was said to be.
  std::vector<std::size_t> sizes(static_cast<std::size_t>(map.relaxation.components));
  for (const RelaxedPose& pose : map.relaxation.poses) ++sizes[static_cast<std::size_t>(pose.component)];
  const std::vector<FrameId> roots = map.roots();
  const auto largest = static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  const Vector3 origin = poses.at(roots.at(largest)).t;
  const Plane plane(root);
  const auto point = [&](FrameId frame) { return plane.point(poses.at(frame).t - origin); };

  std::string text = "{\"type\":\"FeatureCollection\",\"root\":" + quoted(roots[largest].to_string()) + ",\"roots\":[";
  for (std::size_t i = 0; i < roots.size(); ++i) text += (i ? "," : "") + quoted(roots[i].to_string());
  text += "],\"tears\":[";
  for (std::size_t i = 0; i < map.tears.size(); ++i) {
    const Tear& tear = map.tears[i];
    text += (i ? "," : "") + ("{\"edge\":" + quoted(tear.edge.id.to_string()));
    print(text, ",\"metres\":%.4f,\"degrees\":%.3f,\"sigmas\":%.2f}", tear.metres, tear.degrees, tear.sigmas);
  }
  text += "],\"features\":[";
  bool first = true;
  const auto feature = [&](const char* geometry, const std::string& coordinates, const std::string& properties) {
    text += std::string(first ? "\n" : ",\n") + "{\"type\":\"Feature\",\"geometry\":{\"type\":\"" + geometry +
            "\",\"coordinates\":" + coordinates + "},\"properties\":{" + properties + "}}";
    first = false;
  };
  // A session whose frames lie in several components is several lines.
  std::string line;
  std::size_t points = 0;
  const RelaxedPose* before = nullptr;
  const auto end_line = [&] {
    if (!before) return;
    const std::string properties = "\"session\":" + std::to_string(before->frame.session) +
                                   ",\"name\":" + quoted(map.graph.names.at(before->frame.session));
    if (points == 1)
      feature("Point", line, properties);
    else
      feature("LineString", '[' + line + ']', properties);
  };
  for (const RelaxedPose& pose : map.relaxation.poses) {
    if (before && (before->frame.session != pose.frame.session || before->component != pose.component)) {
      end_line();
      line.clear();
      points = 0;
    }
    line += (points++ ? "," : "") + point(pose.frame);
    before = &pose;
  }
  end_line();
  for (const client::Edge& edge : map.graph.edges) {
    if (!in_graph(edge) || edge.kind == client::EdgeKind::kOdometry) continue;
    const bool torn =
        std::any_of(map.tears.begin(), map.tears.end(), [&](const Tear& t) { return t.edge.id == edge.id; });
    feature("LineString", '[' + point(edge.a) + ',' + point(edge.b) + ']',
            "\"edge\":" + quoted(edge.id.to_string()) + ",\"kind\":\"" + kind_of(edge) +
                "\",\"tear\":" + (torn ? "true" : "false"));
  }
  for (const client::LabelledFrames& label : map.labels)
    for (const FrameId frame : label.frames)
      if (poses.contains(frame))
        feature("Point", point(frame), "\"label\":" + quoted(label.label) + ",\"frame\":" + quoted(frame.to_string()));
  return text + "\n]}\n";
}

}  // namespace relmap::cli
