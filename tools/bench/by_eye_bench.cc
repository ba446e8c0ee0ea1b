// relmap-bench by-eye: sheets of loop closures among which one is wrong, for people who try to find it by its pictures
// alone (docs/evidence.md). The map is that of a running daemon, and is not changed.
//
// The wrong pair is the most deceptive of many: two frames of different places whose features match best, with those
// matches joined by lines that one camera motion could explain. All pairs show as many lines, chosen at random, and
// neither names nor figures.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/pair_picture.h"
#include "client/relmap_client.h"
#include "tools/bench/subcommand.h"
#include "tools/sim/random.h"

namespace relmap::bench {

namespace {

using client::Correspondence;
using client::PairPicture;

struct ByEyeOptions {
  std::string server, out = ".", key = "key.txt";
  std::uint64_t seed = 1;
  std::uint32_t sheets = 3, pairs = 10, tries = 200;
  double apart_m = 30, turned_degrees = 100;
};

constexpr std::size_t kFewestLines = 8, kMostLines = 40, kOutliers = 8;
constexpr double kEpipolarPixels = 3;
constexpr double kDistinct = 0.85;  // of the distances of the best and the second best match
constexpr std::uint32_t kSamePlaceFrames = 2;

struct Candidate {
  FrameId a, b;
  std::vector<Correspondence> matches;
  std::size_t agreeing() const {
    return static_cast<std::size_t>(
        std::count_if(matches.begin(), matches.end(), [](const Correspondence& match) { return match.inlier; }));
  }
};

template <typename T>
void shuffle(std::vector<T>& items, sim::Stream& random) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random.bits() % i]);
}

// Marks the matches that one motion of the camera explains best (RANSAC over the fundamental matrix).
void mark_agreeing(std::vector<Correspondence>& matches) {
  std::vector<cv::Point2d> view, frame;
  for (Correspondence& match : matches) {
    match.inlier = false;
    view.emplace_back(match.in_view.x(), match.in_view.y());
    frame.emplace_back(match.in_frame.x(), match.in_frame.y());
  }
  if (matches.size() < kFewestLines) return;
  cv::theRNG().state = 1;
  std::vector<unsigned char> agrees;
  cv::findFundamentalMat(view, frame, cv::FM_RANSAC, kEpipolarPixels, 0.99, 1000, agrees);
  for (std::size_t i = 0; i < agrees.size(); ++i) matches[i].inlier = agrees[i] != 0;
}

class Trial {
 public:
  Trial(const ByEyeOptions& options, client::Client& client) : options_(options), client_(client) {
    client::EdgeFilter filter;
    filter.kinds = {client::EdgeKind::kLoop};
    filter.states = {client::EdgeState::kAccepted};
    closures_ = client.edges(filter).or_throw();
    for (const client::Session& session : client.sessions().or_throw())
      if (session.frames > 0 && session.camera.is_stereo()) sessions_.push_back(session);
    if (closures_.size() < options.pairs) throw std::runtime_error("the map has too few closures in force");
  }

  // One sheet and the number of the wrong pair, from 1.
  std::pair<client::PairSheet, std::uint32_t> sheet(std::uint64_t seed) {
    sim::Stream random(options_.seed, seed);
    const Candidate wrong = wrong_pair(random);
    std::vector<Candidate> pairs = true_pairs(wrong, random);
    const std::size_t at = random.bits() % (pairs.size() + 1);
    pairs.insert(pairs.begin() + static_cast<std::ptrdiff_t>(at), wrong);
    std::size_t lines = kMostLines;
    for (const Candidate& pair : pairs) lines = std::min(lines, pair.agreeing());
    client::PairSheet sheet{"Which pair is wrong?", "", {}};
    for (const Candidate& pair : pairs) {
      sheet.pairs.push_back(picture_of(pair, lines, random));
      sheet.pairs.back().title = "Pair " + std::to_string(sheet.pairs.size());
    }
    return {std::move(sheet), static_cast<std::uint32_t>(at + 1)};
  }

 private:
  std::vector<Candidate> true_pairs(const Candidate& wrong, sim::Stream& random) {
    std::vector<Candidate> pairs;
    std::vector<client::Edge> closures = closures_;
    shuffle(closures, random);
    for (const client::Edge& closure : closures) {
      if (pairs.size() + 1 == options_.pairs) break;
      const auto seen = [&](const Candidate& other) {
        return other.b.session == closure.b.session &&
               std::max(other.b.index, closure.b.index) - std::min(other.b.index, closure.b.index) < kSamePlaceFrames;
      };
      if (std::any_of(pairs.begin(), pairs.end(), seen)) continue;
      const auto explained = client_.explain_edge(closure.id, true);
      if (!explained.ok() || !explained->picture_a || !explained->picture_a->missing.ok() || !explained->picture_b ||
          !explained->picture_b->missing.ok())
        continue;
      Candidate pair{closure.a, closure.b, explained->correspondences};
      if (pair.agreeing() >= std::min(kMostLines, wrong.agreeing())) pairs.push_back(std::move(pair));
    }
    if (pairs.size() + 1 < options_.pairs) throw std::runtime_error("too few closures have pictures at both ends");
    return pairs;
  }

  FrameId some_frame(sim::Stream& random) const {
    const client::Session& session = sessions_[random.bits() % sessions_.size()];
    return {session.number,
            session.first + static_cast<std::uint32_t>(random.bits() % (session.last - session.first + 1))};
  }

  bool is_elsewhere(FrameId a, FrameId b) {
    const auto between = client_.transform_between(a, b);
    if (!between.ok()) return a.session != b.session;  // another recording
    return between->T_ab.t.norm() > options_.apart_m ||
           so3_log(between->T_ab.R).norm() * 180 / M_PI > options_.turned_degrees;
  }

  // What OpenCV's detector finds in the picture of a frame; null: it keeps none.
  struct Features {
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
    double scale = 1;
  };
  const Features* features_of(FrameId frame) {
    const auto [at, fresh] = features_.try_emplace(frame);
    if (fresh) {
      const auto found = client_.frame(frame, false, true);
      if (!found.ok() || !found->picture || !found->picture->missing.ok()) return nullptr;
      const std::string& data = found->picture->data;
      const cv::Mat picture = cv::imdecode(std::vector<unsigned char>(data.begin(), data.end()), cv::IMREAD_GRAYSCALE);
      at->second.scale = found->picture->scale;
      cv::ORB::create(1500)->detectAndCompute(picture, cv::noArray(), at->second.points, at->second.descriptors);
    }
    return at->second.descriptors.empty() ? nullptr : &at->second;
  }

  // What both pictures seem to show.
  Candidate matched(FrameId place, FrameId view) {
    Candidate candidate{place, view, {}};
    const Features* const old = features_of(place);
    const Features* const now = features_of(view);
    if (!old || !now) return candidate;
    std::vector<std::vector<cv::DMatch>> matches;
    cv::BFMatcher(cv::NORM_HAMMING).knnMatch(now->descriptors, old->descriptors, matches, 2);
    for (const auto& best : matches) {
      if (best.size() < 2 || best[0].distance > kDistinct * best[1].distance) continue;
      const cv::Point2f in_view = now->points[static_cast<std::size_t>(best[0].queryIdx)].pt,
                        in_frame = old->points[static_cast<std::size_t>(best[0].trainIdx)].pt;
      Correspondence& match = candidate.matches.emplace_back();
      match.in_view = Vector2(in_view.x, in_view.y) / now->scale;
      match.in_frame = Vector2(in_frame.x, in_frame.y) / old->scale;
    }
    mark_agreeing(candidate.matches);
    return candidate;
  }

  // Of many pairs of frames of different places the one in which most matches agree.
  Candidate wrong_pair(sim::Stream& random) {
    Candidate best;
    for (std::uint32_t k = 0; k < options_.tries; ++k) {
      const FrameId view = closures_[random.bits() % closures_.size()].b, place = some_frame(random);
      if (!is_elsewhere(place, view)) continue;
      Candidate candidate = matched(place, view);
      if (candidate.agreeing() > best.agreeing()) best = std::move(candidate);
    }
    if (best.agreeing() < kFewestLines) throw std::runtime_error("no two places look alike; try more --tries");
    return best;
  }

  PairPicture::Side side_of(FrameId frame, const char* title) {
    PairPicture::Side side;
    side.title = title;
    side.picture = *client_.frame(frame, false, true).or_throw().picture;
    for (const client::Session& session : sessions_)
      if (session.number == frame.session) {
        side.camera_width = session.camera.width;
        side.camera_height = session.camera.height;
      }
    return side;
  }

  PairPicture picture_of(const Candidate& pair, std::size_t lines, sim::Stream& random) {
    PairPicture picture;
    picture.left = side_of(pair.a, "then");
    picture.right = side_of(pair.b, "now");
    std::vector<Correspondence> matches = pair.matches;
    shuffle(matches, random);
    std::size_t agreeing = 0, others = 0;
    for (const Correspondence& match : matches)
      if (match.inlier ? agreeing++ < lines : others++ < kOutliers)
        picture.points.push_back({match.in_frame, match.in_view, match.inlier, false});
    return picture;
  }

  const ByEyeOptions& options_;
  client::Client& client_;
  std::vector<client::Edge> closures_;
  std::vector<client::Session> sessions_;
  std::map<FrameId, Features> features_;
};

void run(const ByEyeOptions& options, Report& report) {
  const auto client = client::Client::connect(options.server).or_throw();
  std::filesystem::create_directories(options.out);
  Trial trial(options, *client);
  std::string key;
  for (std::uint32_t k = 1; k <= options.sheets; ++k) {
    const auto [sheet, wrong] = trial.sheet(k);
    const std::string name = options.out + "/sheet" + std::to_string(k);
    const std::string bytes = client::draw_pair_sheet(sheet, client::PictureFormat::kPng).or_throw();
    if (Status written = client::write_file(name + ".png", bytes); !written.ok())
      throw std::runtime_error(written.to_string());
    key += "sheet " + std::to_string(k) + ": pair " + std::to_string(wrong) + '\n';
  }
  if (Status written = client::write_file(options.key, key); !written.ok())
    throw std::runtime_error(written.to_string());
  report.add("sheets", options.sheets, "written; in each one pair is wrong");
  report.add("pairs", options.pairs, "on each sheet");
}

}  // namespace

Run declare_by_eye(CLI::App& app) {
  const auto options = std::make_shared<ByEyeOptions>();
  app.add_option("--server", options->server, "Daemon whose map has closures with pictures: folder or HOST:PORT")
      ->required();
  app.add_option("--out", options->out, "Folder for the sheets")->type_name("DIR")->capture_default_str();
  app.add_option("--key", options->key, "File for the numbers of the wrong pairs")->capture_default_str();
  app.add_option("--sheets", options->sheets, "Sheets")->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--pairs", options->pairs, "Pairs on a sheet, one of which is wrong")
      ->check(CLI::Range(2, 50))
      ->capture_default_str();
  app.add_option("--seed", options->seed, "Of all choices")->capture_default_str();
  app.add_option("--tries", options->tries, "Pairs of places among which the most deceptive is chosen")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--apart", options->apart_m, "Metres from which two places are different ones")->capture_default_str();
  app.add_option("--turned", options->turned_degrees, "Degrees from which two views are of different things")
      ->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
