#include "tools/g2o/pose_graph.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>

#include "proto/geometry/covariance.h"

namespace relmap::g2o {

namespace {

constexpr double kUnknown = 1e-8;
constexpr double kMaxMetres = 1e7, kMaxRadians = 1e4;

// Camera from robot.
const Matrix3& camera_axes() {
  static const Matrix3 axes = (Matrix3() << 0, -1, 0, 0, 0, -1, 1, 0, 0).finished();
  return axes;
}

SE3 to_camera(const SE3& T) {
  const Matrix3& C = camera_axes();
  return {C * T.R * C.transpose(), C * T.t};
}

Matrix6 to_camera(const Matrix6& covariance) {
  Matrix6 C = Matrix6::Zero();
  C.topLeftCorner<3, 3>() = C.bottomRightCorner<3, 3>() = camera_axes();
  return C * covariance * C.transpose();
}

// What an edge of the file says, by the ids of its ends.
struct Measurement {
  std::size_t line = 0;
  std::uint32_t a = 0, b = 0;
  SE3 T_ab;
  Matrix6 covariance;
};

class Parser {
 public:
  Parser(const std::string& name, PoseAxes axes) : name_(name), axes_(axes) {}

  Status line(std::string_view text) {
    ++number_;
    rest_ = text;
    const std::string_view kind = word();
    if (kind.empty() || kind.front() == '#') return {};
    if (kind == "VERTEX_SE2") return vertex(true);
    if (kind == "VERTEX_SE3:QUAT") return vertex(false);
    if (kind == "EDGE_SE2") return edge(true);
    if (kind == "EDGE_SE3:QUAT") return edge(false);
    ++left_out_[std::string(kind)];
    return {};
  }

  Result<PoseGraph> finish() {
    PoseGraph graph;
    const bool edges_only = vertices_.empty();
    if (edges_only)
      for (const Measurement& m : measurements_) vertices_[m.a] = vertices_[m.b] = SE3();
    std::unordered_map<std::uint32_t, std::uint32_t> numbers;
    for (const auto& [id, pose] : vertices_) {
      numbers.emplace(id, static_cast<std::uint32_t>(graph.ids.size()));
      graph.ids.push_back(id);
      graph.poses.push_back(pose);
    }
    graph.planar = planar_.value_or(false);
    graph.left_out = std::move(left_out_);
    for (const Measurement& m : measurements_) {
      const auto a = numbers.find(m.a), b = numbers.find(m.b);
      if (a == numbers.end() || b == numbers.end()) return corrupt(m.line, "an edge to a vertex that is not there");
      if (a == b)
        graph.self_edges.push_back(m.line);
      else
        add(graph, m.line, {a->second, b->second, m.T_ab, m.covariance});
    }
    std::sort(graph.odometry.begin(), graph.odometry.end(), [](const auto& p, const auto& q) { return p.a < q.a; });
    if (edges_only) {
      for (std::uint32_t i = 1; i < graph.ids.size(); ++i) {
        const Edge* const step = graph.step_to(i);
        if (!step)
          return Status(Reason::CORRUPT, name_ + ": no vertices, and no odometry to " + std::to_string(graph.ids[i]));
        graph.poses[i] = graph.poses[i - 1] * step->T_ab;
      }
    }
    return graph;
  }

 private:
  using Edge = PoseGraph::Edge;

  Status corrupt(std::size_t line, const std::string& what) const {
    return {Reason::CORRUPT, name_ + ", line " + std::to_string(line) + ": " + what};
  }
  Status corrupt(const std::string& what) const { return corrupt(number_, what); }

  std::string_view word() {
    constexpr std::string_view kSpace = " \t\r\f\v";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size()));
    const std::string_view found = rest_.substr(0, rest_.find_first_of(kSpace));
    rest_.remove_prefix(found.size());
    return found;
  }
  template <typename T>
  bool read(T& value) {
    const std::string_view text = word();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
  }
  bool read_all(std::span<double> values) {
    return std::all_of(values.begin(), values.end(), [this](double& v) { return read(v) && std::isfinite(v); });
  }

  Status one_kind(bool planar) {
    if (planar_.value_or(planar) != planar) return corrupt("poses in the plane and poses in space");
    planar_ = planar;
    return {};
  }

  Status pose(bool planar, SE3& T) {
    if (Status status = any_pose(planar, T); !status.ok()) return status;
    return T.t.norm() <= kMaxMetres ? Status() : corrupt("more than 10,000 km");
  }

  Status any_pose(bool planar, SE3& T) {
    if (planar) {
      std::array<double, 3> p;
      if (!read_all(p)) return corrupt("x, y and theta are wanted");
      if (std::abs(p[2]) > kMaxRadians) return corrupt("an angle of more than 10,000 radians");
      T = to_camera(SE3{so3_exp({0, 0, p[2]}), {p[0], p[1], 0}});
      return {};
    }
    std::array<double, 7> p;
    if (!read_all(p)) return corrupt("x, y, z and a quaternion are wanted");
    const Eigen::Quaterniond q(p[6], p[3], p[4], p[5]);
    if (std::abs(q.norm() - 1) > 1e-2) return corrupt("the quaternion is no rotation");
    T = {q.normalized().toRotationMatrix(), {p[0], p[1], p[2]}};
    if (axes_ == PoseAxes::kRobot) T = to_camera(T);
    return {};
  }

  Status vertex(bool planar) {
    std::uint32_t id = 0;
    if (!read(id)) return corrupt("a vertex whose number is not 0..4294967295");
    SE3 T;
    if (Status status = pose(planar, T); !status.ok()) return status;
    if (Status status = one_kind(planar); !status.ok()) return status;
    if (!vertices_.emplace(id, T).second) return corrupt("vertex " + std::to_string(id) + " was there before");
    return {};
  }

  Status edge(bool planar) {
    Measurement m;
    m.line = number_;
    if (!read(m.a) || !read(m.b)) return corrupt("an edge between vertices whose numbers are not 0..4294967295");
    if (Status status = pose(planar, m.T_ab); !status.ok()) return status;
    if (Status status = one_kind(planar); !status.ok()) return status;
    const bool known = planar ? covariance_in_plane(m.covariance) : covariance_in_space(m.covariance);
    if (!known || !check_covariance(m.covariance).ok()) return corrupt("the information matrix is none");
    measurements_.push_back(m);
    return {};
  }

  bool covariance_in_plane(Matrix6& covariance) {
    std::array<double, 6> u;
    if (!read_all(u)) return false;
    Matrix3 information;
    information << u[0], u[1], u[2], u[1], u[3], u[4], u[2], u[4], u[5];
    if (information.llt().info() != Eigen::Success) return false;
    const Matrix3 plane = information.inverse();
    constexpr int kRows[] = {0, 1, 5};  // of x, y, theta
    covariance = kUnknown * Matrix6::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) covariance(kRows[i], kRows[j]) = plane(i, j);
    covariance = to_camera(covariance);
    return true;
  }

  bool covariance_in_space(Matrix6& covariance) {
    UpperTriangle upper;
    if (!read_all(upper)) return false;
    const Matrix6 information = from_upper_triangle(upper);
    if (information.llt().info() != Eigen::Success) return false;
    Vector6 scale;  // a small rotation is twice the vector part of its quaternion
    scale << 1, 1, 1, 2, 2, 2;
    covariance = scale.asDiagonal() * information.inverse() * scale.asDiagonal();
    covariance = (covariance + covariance.transpose()).eval() / 2;
    if (axes_ == PoseAxes::kRobot) covariance = to_camera(covariance);
    return true;
  }

  void add(PoseGraph& graph, std::size_t line, Edge edge) {
    const bool step = (edge.a > edge.b ? edge.a - edge.b : edge.b - edge.a) == 1;
    const bool odometry = step && has_step_.insert(std::max(edge.a, edge.b)).second;
    if ((edge.b > edge.a) != odometry) {
      edge.covariance = inverse_covariance(edge.T_ab, edge.covariance);
      edge.T_ab = edge.T_ab.inverse();
      std::swap(edge.a, edge.b);
    }
    if (odometry)
      graph.odometry.push_back(edge);
    else if (has_loop_.insert({edge.a, edge.b}).second)
      graph.loops.push_back(edge);
    else
      graph.parallel_loops.push_back(line);
  }

  const std::string& name_;
  const PoseAxes axes_;
  std::size_t number_ = 0;
  std::string_view rest_;
  std::optional<bool> planar_;
  std::map<std::uint32_t, SE3> vertices_;
  std::vector<Measurement> measurements_;
  std::set<std::uint32_t> has_step_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> has_loop_;
  std::map<std::string, std::size_t> left_out_;
};

}  // namespace

const PoseGraph::Edge* PoseGraph::step_to(std::uint32_t frame) const {
  const auto found =
      std::partition_point(odometry.begin(), odometry.end(), [&](const Edge& edge) { return edge.b < frame; });
  return found != odometry.end() && found->b == frame ? &*found : nullptr;
}

Result<PoseGraph> parse_pose_graph(std::string_view text, const std::string& name, PoseAxes axes) {
  Parser parser(name, axes);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (Status status = parser.line(text.substr(0, end)); !status.ok()) return status;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parser.finish();
}

Result<PoseGraph> read_pose_graph(const std::string& path, PoseAxes axes) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return {Reason::NO_SUCH_FILE, path + " cannot be opened"};
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in.bad()) return {Reason::IO_ERROR, path + " cannot be read"};
  return parse_pose_graph(text, path, axes);
}

}  // namespace relmap::g2o
