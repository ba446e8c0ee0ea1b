// relmap frame and transform: one frame, and the transform between two frames.
#include <cmath>
#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/typed_text.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all.empty() ? "none" : all;
}

void print(const client::Frame& f, terminal::Console& console) {
  std::vector<std::string> edges, incoming;
  for (const client::Edge& e : f.edges)
    edges.push_back(e.id.to_string() + " to " + (e.a == f.id ? e.b : e.a).to_string() + " (" + name_of(e.kind) + ", " +
                    name_of(e.state) + ")");
  for (const EdgeId& id : f.incoming) incoming.push_back(id.to_string());
  console.facts({{"frame", f.id.to_string()},
                 {"time", terminal::time_text(f.time_us)},
                 {"labels", joined(f.labels)},
                 {"edges", joined(edges)},
                 {"from newer frames", joined(incoming)},
                 {"landmarks", count_text(f.landmarks) + " based here"},
                 {"observations", count_text(f.observations)},
                 {"appearance", counted_text(f.appearance, "feature")},
                 {"mean error", f.mean_error ? fixed(*f.mean_error, 2) + " px" : "never relaxed"},
                 {"robot's odometry", terminal::vector_text(f.T_odom_frame.t) + " m, as the robot told it"}});
}

}  // namespace

void add_frame(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("frame", "show one frame: its edges, labels and counts");
  auto id = std::make_shared<std::string>();
  command->add_option("ID", *id, "session:index")->required()->check(parsed_by(parse_frame));
  command->footer(
      "Example:\n  relmap frame 3:120\n"
      "\"robot's odometry\" is the pose that the robot sent, in its own odometry frame. The map never changes it; "
      "relmap\n"
      "export gives the poses as the map has refined them.");
  command->callback([&action, id] {
    action = [id](client::Client& client, terminal::Console& console) -> Status {
      const auto frame_id = parse_frame(*id);
      if (!frame_id.ok()) return frame_id.status();
      const auto frame = client.frame(*frame_id);
      if (!frame.ok()) return frame.status();
      if (!console.json) print(*frame, console);
      return {};
    };
  });
}

void add_transform(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("transform", "compute the pose of frame B in frame A");
  auto ids = std::make_shared<std::pair<std::string, std::string>>();
  command->add_option("A", ids->first, "session:index")->required()->check(parsed_by(parse_frame));
  command->add_option("B", ids->second, "session:index")->required()->check(parsed_by(parse_frame));
  command->footer("Example:\n  relmap transform 1:20 3:120");
  command->callback([&action, ids] {
    action = [ids](client::Client& client, terminal::Console& console) -> Status {
      const auto a = parse_frame(ids->first), b = parse_frame(ids->second);
      if (!a.ok()) return a.status();
      if (!b.ok()) return b.status();
      const auto found = client.transform_between(*a, *b);
      if (!found.ok()) return found.status();
      if (console.json) return {};
      const Vector6 sigma = found->covariance.diagonal().cwiseSqrt();
      std::vector<std::pair<std::string, std::string>> facts{
          {"translation",
           terminal::vector_text(found->T_ab.t) + " m, sigmas " + terminal::vector_text(sigma.head<3>())},
          {"rotation",
           terminal::vector_text(so3_log(found->T_ab.R)) + " rad, sigmas " + terminal::vector_text(sigma.tail<3>())},
          {"path", counted_text(found->edges, "edge") + ", " + fixed(found->distance_m, 2) + " m" +
                       (found->compounded ? "; covariance compounded" : "")}};
      if (const std::string text = unmeasured_text(found->unmeasured, found->distance_m); !text.empty())
        facts.emplace(facts.begin(), "not measured", text);
      if (const std::string text = carried_text(found->carried); !text.empty()) facts.emplace_back("carried", text);
      console.facts(facts);
      return {};
    };
  });
}

}  // namespace relmap::cli
