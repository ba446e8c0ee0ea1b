#include "tools/bench/vast/vast_page.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>

#include "proto/base/markup.h"
#include "proto/base/quantile.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tools/bench/plot.h"

namespace relmap::bench {

namespace {

// A plot as an <svg> element.
std::string drawn(const Plot& plot) {
  const storage::TemporaryFolder folder;
  save_plot(plot, folder / "plot.svg");
  return testing::read_text(folder / "plot.svg");
}

std::string figure(const std::string& svg, const std::string& caption) {
  return "<figure>" + svg + "<figcaption>" + markup_text(caption) + "</figcaption></figure>\n";
}

struct Row {
  std::string what, ours, paper;
};

std::string text_of(double value, int digits) {
  std::ostringstream out;
  out.setf(std::ios::fixed);
  out.precision(digits);
  out << value;
  return out.str();
}

// Sibley, Mei, Reid and Newman, IJRR 2010: tables 1 and 2.
std::vector<Row> beside_the_paper(const VastProgress& progress, const VastVerdict& verdict) {
  const auto keyframes = static_cast<double>(verdict.keyframes);
  return {
      {"distance", text_of(verdict.metres / 1000, 1) + " km", "142 km in five data sets, the longest 121 km"},
      {"images", std::to_string(verdict.keyframes) + " keyframes", "856,239 images at 20 Hz"},
      {"on disk",
       text_of(static_cast<double>(verdict.bytes_on_disk) / 1e9, 1) + " GB, " +
           text_of(static_cast<double>(verdict.bytes_on_disk) / 1000 / keyframes, 1) + " kB a keyframe",
       "333.6 GB, 390 kB an image (with the images)"},
      {"frames per second", text_of(keyframes / progress.s, 1) + " keyframes, of all robots together",
       "22.2 images on average (table 2)"},
      {"loops", std::to_string(verdict.closures_right) + " right, " + std::to_string(verdict.closures_wrong) + " wrong",
       "not reported"},
      {"carried",
       std::to_string(verdict.rides_closed) + " of " + std::to_string(verdict.rides_returned) +
           " rides after which a known place was seen",
       "trains, lifts and others; 89.4 % of the way measured by vision"}};
}

Curve over_frames(const VastProgress& progress, std::string name, double VastSample::*value) {
  Curve curve{std::move(name), {}, {}};
  for (const VastSample& sample : progress.samples) {
    curve.x.push_back(static_cast<double>(sample.frames));
    curve.y.push_back(sample.*value);
  }
  return curve;
}

Curve places_over_frames(const VastProgress& progress) {
  Curve curve{"answers", {}, {}};
  const std::size_t share = progress.places.size() / 50 + 1;
  for (std::size_t from = 0; from < progress.places.size(); from += share) {
    const std::size_t to = std::min(from + share, progress.places.size());
    std::vector<double> ms;
    for (std::size_t i = from; i < to; ++i) ms.push_back(progress.places[i].ms);
    curve.x.push_back(static_cast<double>(progress.places[(from + to) / 2].frames));
    curve.y.push_back(quantile(ms, 0.5));
  }
  return curve;
}

}  // namespace

void write_page(const VastOptions& options, const VastProgress& progress, const VastVerdict& verdict,
                const Report& report) {
  std::ofstream out(options.page);
  out << "<!doctype html>\n<meta charset=\"utf-8\">\n<title>relmap: a town</title>\n<style>\n"
         "body { font: 16px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #282c34 }\n"
         "table { border-collapse: collapse } td, th { text-align: left; padding: .2em 1em .2em 0; "
         "border-bottom: 1px solid #dee2e8; vertical-align: top }\n"
         "figure { margin: 2em 0 } figure svg { max-width: 100%; height: auto }\n"
         "figcaption { color: #555 }\n</style>\n";
  out << "<h1>" << text_of(verdict.metres / 1000, 0) << " km through a town of "
      << text_of(verdict.street_metres / 1000, 1) << " km of streets</h1>\n";
  out << "<p>" << options.robots << " robots drove through a simulated town at the same time. Everything went through "
      << "relmapd in " << options.memory_budget_mb << " MB, which was killed " << progress.kills
      << " times. Landmarks and descriptors are made up (points, not pictures); the truth is exact.</p>\n";
  if (options.picture.ends_with(".svg"))
    out << figure(testing::read_text(options.picture), "The whole map, relaxed into one frame.");
  out << "<h2>Beside the paper</h2>\n<table><tr><th></th><th>here</th><th>Sibley et al. 2010</th></tr>\n";
  for (const Row& row : beside_the_paper(progress, verdict))
    out << "<tr><td>" << row.what << "</td><td>" << row.ours << "</td><td>" << row.paper << "</td></tr>\n";
  out << "</table>\n<h2>While the map grew</h2>\n";
  out << figure(drawn({"Time of an update, 99 %",
                       "keyframes in the map",
                       "us",
                       false,
                       false,
                       {over_frames(progress, "relaxation", &VastSample::update_p99_us)}}),
                "Relative bundle adjustment after a keyframe, of the last updates at each second.");
  out << figure(
      drawn({"Where is this frame?", "keyframes in the map", "ms", false, false, {places_over_frames(progress)}}),
      "Until the daemon has answered over RPC, while keyframes streamed in: the median of each fiftieth of the "
      "questions. The paper's Figure 17 has the time of a query of FAB-MAP.");
  out << figure(drawn({"How far lookups are behind",
                       "keyframes in the map",
                       "s",
                       false,
                       false,
                       {over_frames(progress, "lookups", &VastSample::lookup_lag_s)}}),
                "How long the keyframe that waits longest for its lookup had been in the map.");
  out << figure(drawn({"Resident memory",
                       "keyframes in the map",
                       "MB",
                       false,
                       false,
                       {over_frames(progress, "relmapd", &VastSample::resident_mb)}}),
                "Of the daemon, the most since its start.");
  std::ostringstream table;
  report.print_table(table);
  out << "<h2>All figures</h2>\n<pre>" << markup_text(table.str()) << "</pre>\n";
  if (!out.flush()) throw StatusError(Status(Reason::IO_ERROR, options.page + " cannot be written"));
}

}  // namespace relmap::bench
