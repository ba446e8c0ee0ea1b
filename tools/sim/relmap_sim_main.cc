// relmap-sim: writes drives through simulated worlds as files.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "proto/base/json.h"
#include "proto/base/mutex.h"
#include "proto/base/printf_text.h"
#include "proto/keyframe/keyframe.h"
#include "tools/sim/inertial.h"
#include "tools/sim/picture_world.h"
#include "tools/sim/points_world.h"
#include "tools/terminal/command_line.h"
#include "tools/terminal/progress_bar.h"

namespace {

namespace fs = std::filesystem;
using relmap::printf_text;
using relmap::SE3;
using relmap::StereoCamera;

std::ofstream create(const fs::path& path) {
  std::ofstream out(path, std::ios::binary);
  out.exceptions(std::ios::failbit | std::ios::badbit);
  return out;
}

// Creates the folder. Refuses one that holds another drive, since the two would mix.
void prepare_folder(const fs::path& folder, bool overwrite) {
  if (fs::exists(folder) && !fs::is_empty(folder)) {
    if (!overwrite || !fs::exists(folder / "sim.json"))
      throw std::runtime_error(
          folder.string() + " is not empty" +
          (overwrite ? " and holds no simulated drive" : "; --overwrite replaces a simulated drive"));
    for (const char* part : {"image_0", "image_1", "calib.txt", "times.txt", "poses.txt", "keyframes.bin", "sim.json",
                             "faults.csv", "rides.csv", "imu.csv", "imu.yaml"})
      fs::remove_all(folder / part);
  }
  fs::create_directories(folder);
}

// The left camera in the first left camera's coordinates, 3x4, row by row.
std::string kitti_pose(const SE3& T) {
  std::string line;
  for (int r = 0; r < 3; ++r)
    line += printf_text("%s%.9e %.9e %.9e %.9e", r == 0 ? "" : " ", T.R(r, 0), T.R(r, 1), T.R(r, 2), T.t(r));
  return line + "\n";
}

template <typename PoseOf>
void write_poses(const fs::path& path, int frames, const PoseOf& pose_of) {
  std::ofstream out = create(path);
  const SE3 T_first_world = pose_of(0).inverse();
  for (int i = 0; i < frames; ++i) out << kitti_pose(T_first_world * pose_of(i));
}

std::string kitti_calibration(const StereoCamera& c) {
  const auto row = [&](const char* name, double shift) {
    return printf_text("%s: %.12e 0 %.12e %.12e 0 %.12e %.12e 0 0 0 1 0\n", name, c.f, c.cx, shift, c.f, c.cy);
  };
  return row("P0", 0) + row("P1", -c.f * c.baseline);
}

struct PicturesCommand {
  relmap::sim::PictureWorldOptions world;
  relmap::sim::InertialOptions inertial;
  bool imu = false;
  std::string out, picture_format = "png", faults = "none", scene_kind = "street", light = "clear", ride = "none";
  int threads = std::max(1U, std::thread::hardware_concurrency());
  bool overwrite = false, on_foot = false;
  int width = 0;

  void add_to(CLI::App& app) {
    CLI::App* c = app.add_subcommand("pictures", "Render a textured world in stereo, in KITTI's layout");
    c->footer(
        "Example:\n"
        "  relmap-sim pictures --out drive --seed 1 --pairs 650 --laps 1.3\n"
        "Files:\n"
        "  image_0/000000.png ... and image_1/   left and right pictures, rectified\n"
        "  calib.txt                             P0 and P1\n"
        "  times.txt                             seconds since the first pair\n"
        "  poses.txt                             truth: left camera in the first one's frame, 3x4 by rows\n"
        "  faults.csv                            with faults: frame,kind of each faulty frame\n"
        "  rides.csv                             with --ride: frame,carried,moving_share of each frame in a lift,\n"
        "                                        wagon or escalator; moving_share is the share of pixels that do not\n"
        "                                        show the fixed world\n"
        "  imu.csv, imu.yaml                     with --imu: in EuRoC's format, by the clock of times.txt\n"
        "  sim.json                              the options, and the pose of the first left camera in the world\n"
        "\n"
        "Pictures are named by the numbers of their frames. A dropped pair has no picture, no time and no pose.\n"
        "For a fleet, give all robots the same --seed, and each its own --drive-seed, --start and --light.\n"
        "Faults: dropped, black, long_black, swivel, blur, one_eye, mover, doubled, time_back, time_ahead.");
    c->add_option("--out", out, "Folder to write")->type_name("FOLDER")->required();
    c->add_option("--seed", world.seed, "Seed of the world, and of the drive unless --drive-seed is given")
        ->capture_default_str();
    c->add_option("--drive-seed", world.drive_seed, "Seed of the drive: sway, speed, traffic, exposure, noise, faults");
    c->add_option("--start", world.start, "Metres along the circuit where the drive begins")->capture_default_str();
    c->add_option("--light", light, "clear, morning or evening (a low sun from either side), overcast, or dusk (dark)")
        ->check(CLI::IsMember({"clear", "morning", "evening", "overcast", "dusk"}))
        ->capture_default_str();
    c->add_option("--scene", scene_kind,
                  "street, or motorway: little texture, KITTI's camera, 2.5 m a pair, a circuit of 2 to 5 km")
        ->check(CLI::IsMember({"street", "motorway"}))
        ->capture_default_str();
    c->add_option(
         "--ride", ride,
         "The robot is carried on its way. lift: up and down between two floors that differ; lift-alike: between "
         "floors that look alike except for a few things; lift-ramp: up a ramp, and down by lift; train; "
         "escalator; alike: not carried, it stands still as long in a building whose halves look alike")
        ->check(CLI::IsMember({"none", "lift", "lift-alike", "lift-ramp", "train", "escalator", "alike"}))
        ->capture_default_str();
    c->add_flag("--on-foot", on_foot,
                "With --ride: the robot is not carried; it waits where it would board, and drives all the way");
    c->add_option("--width", width, "Width of the pictures, pixels; the field of view stays the same")
        ->check(CLI::Range(160, 4096));
    c->add_option("--pairs", world.frames, "Number of stereo pairs")->capture_default_str();
    c->add_option("--laps", world.laps, "Times round the circuit, which is pairs * step / laps long")
        ->capture_default_str();
    c->add_option("--step", world.step, "Metres between two pairs, on average")->capture_default_str();
    c->add_option("--rate", world.rate, "Pairs per second")->capture_default_str();
    c->add_option("--baseline", world.camera.baseline, "Stereo baseline, metres")->capture_default_str();
    c->add_option("--noise", world.noise, "Standard deviation of a pixel's value (0 to 255)")->capture_default_str();
    c->add_option("--exposure-variation", world.exposure_variation, "Slow change of the gain, relative, at most")
        ->capture_default_str();
    c->add_option("--exposure-jumps", world.exposure_jumps, "Sudden changes of the gain per 100 pairs")
        ->capture_default_str();
    c->add_option("--exposure", world.exposure_s, "Exposure time in seconds, for motion blur")->capture_default_str();
    c->add_option("--faults", faults,
                  "What goes wrong: none, all (which also drops 5 % of the pairs), or kind:frame,kind:frame...")
        ->capture_default_str();
    c->add_option("--drop-share", world.drop_share, "Share of the pairs that are dropped")->capture_default_str();
    c->add_flag("--imu", imu, "Write also the measurements of an inertial unit");
    c->add_option("--imu-offset", inertial.time_offset,
                  "Seconds that the inertial unit's clock is ahead of the pictures'")
        ->check(CLI::Range(-1.0, 1.0))
        ->capture_default_str();
    c->add_option("--lateral-deviation", world.lateral_deviation,
                  "Distance from the middle of the road, metres, at most")
        ->capture_default_str();
    c->add_option("--heading-deviation", world.heading_deviation,
                  "Deviation of the heading from the road, radians, at most")
        ->capture_default_str();
    c->add_option("--format", picture_format, "png or jpg (quality 95)")
        ->check(CLI::IsMember({"png", "jpg"}))
        ->capture_default_str();
    c->add_option("--threads", threads, "Number of pictures rendered at a time (default: one a processor)")
        ->check(CLI::Range(1, 64));
    c->add_flag("--overwrite", overwrite, "Replace the simulated drive in the folder");
    c->final_callback([this, c] {
      world.light = *relmap::sim::daylight_of(light);
      if (scene_kind == "motorway") take_to_motorway(*c);
      if (ride != "none") take_along(*c);
      if (width > 0) world.camera = relmap::sim::scaled(world.camera, width);
      run();
    });
  }

  // Takes the defaults of the motorway for options that are not given.
  void take_to_motorway(const CLI::App& given) {
    const relmap::sim::PictureWorldOptions motorway = relmap::sim::motorway_options(world.seed, world.frames);
    const double baseline = world.camera.baseline;
    world.scene = motorway.scene;
    world.camera = motorway.camera;
    world.camera_height = motorway.camera_height;
    if (given.count("--baseline") > 0) world.camera.baseline = baseline;
    if (given.count("--step") == 0) world.step = motorway.step;
    if (given.count("--laps") == 0) world.laps = world.frames * world.step / motorway.circuit_length();
    if (given.count("--heading-deviation") == 0) world.heading_deviation = motorway.heading_deviation;
  }

  // A ride has a scene, a circuit and a length of its own.
  void take_along(const CLI::App& given) {
    for (const char* other : {"--scene", "--laps", "--start"})
      if (given.count(other) > 0) throw CLI::ValidationError("--ride", std::string("excludes ") + other);
    const relmap::sim::PictureWorldOptions own =
        relmap::sim::ride_options(*relmap::sim::ride_of(ride), world.seed, !on_foot);
    world.scene = own.scene;
    world.ride = own.ride;
    world.carried = own.carried;
    world.ride_way = own.ride_way;
    if (given.count("--lateral-deviation") == 0) world.lateral_deviation = own.lateral_deviation;
    if (given.count("--pairs") == 0) world.frames = relmap::sim::frames_of_ride(world);
    scene_kind = own.scene == relmap::sim::SceneKind::kBuilding ? "building" : "street";
  }

  void run() {
    if (const relmap::Status status = world.set_faults(faults); !status.ok())
      throw std::runtime_error(status.to_string());
    if (const relmap::Status status = world.check(); !status.ok()) throw std::runtime_error(status.to_string());
    const fs::path folder = out;
    prepare_folder(folder, overwrite);
    fs::create_directories(folder / "image_0");
    fs::create_directories(folder / "image_1");
    const relmap::sim::PictureWorld scene(world);
    create(folder / "calib.txt") << kitti_calibration(world.camera);
    std::ofstream times = create(folder / "times.txt");
    std::vector<int> delivered;
    for (int i = 0; i < world.frames; ++i)
      if (!scene.dropped(i)) delivered.push_back(i);
    for (const int i : delivered)
      times << printf_text("%.6e\n", static_cast<double>(scene.time_us(i) - scene.time_us(0)) * 1e-6);
    write_poses(folder / "poses.txt", static_cast<int>(delivered.size()),
                [&](int k) { return scene.truth(delivered[k]); });
    if (!world.faults.empty() || world.drop_share > 0) write_faults(scene, folder / "faults.csv");
    if (world.ride != relmap::sim::RideKind::kNone) write_rides(scene, delivered, folder / "rides.csv");
    if (imu) write_inertial(scene, folder);
    create(folder / "sim.json") << description(scene.truth(0));
    render(scene, folder);
  }

  // The axes of the inertial unit are EuRoC's: x up, y right, z ahead. It sits a little beside the left camera.
  void write_inertial(const relmap::sim::PictureWorld& scene, const fs::path& folder) {
    inertial.seed = world.seed_of_drive();
    inertial.calibration.R_camera_imu << 0, 1, 0, -1, 0, 0, 0, 0, 1;
    inertial.position = relmap::Vector3(0.05, 0.02, -0.03);
    std::ofstream csv = create(folder / "imu.csv");
    csv << "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
           "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
    for (const relmap::ImuSample& sample : relmap::sim::simulate_inertial(scene, inertial)) {
      const relmap::Vector3 &w = sample.gyro, &a = sample.acceleration;
      csv << printf_text("%lld,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n",
                         static_cast<long long>(sample.time_us - world.start_us) * 1000, w.x(), w.y(), w.z(), a.x(),
                         a.y(), a.z());
    }
    create(folder / "imu.yaml") << inertial_calibration();
  }

  std::string inertial_calibration() const {
    const relmap::Matrix3& R = inertial.calibration.R_camera_imu;
    std::string text =
        "# EuRoC's layout, but that body B is the left camera: T_BS takes points from the unit to the camera.\n"
        "sensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
    for (int r = 0; r < 3; ++r)
      text += printf_text("%.9g, %.9g, %.9g, %.9g,\n         ", R(r, 0), R(r, 1), R(r, 2), inertial.position(r));
    return text +
           printf_text(
               "0, 0, 0, 1]\nrate_hz: %g\ngyroscope_noise_density: %g  # rad/s/sqrt(Hz)\n"
               "gyroscope_random_walk: %g  # rad/s^2/sqrt(Hz)\naccelerometer_noise_density: %g  # m/s^2/sqrt(Hz)\n"
               "accelerometer_random_walk: %g  # m/s^3/sqrt(Hz)\n"
               "timeshift_cam_imu: %g  # seconds, kalibr's: t_imu = t_cam + timeshift\n",
               inertial.rate, inertial.calibration.gyro_noise, inertial.calibration.gyro_walk,
               inertial.acceleration_noise, inertial.acceleration_walk, inertial.time_offset);
  }

  void write_faults(const relmap::sim::PictureWorld& scene, const fs::path& path) const {
    std::ofstream csv = create(path);
    csv << "frame,kind\n";
    for (int i = 0; i < world.frames; ++i)
      if (const relmap::sim::FaultKind kind = scene.fault_at(i); kind != relmap::sim::FaultKind::kNone)
        csv << i << "," << relmap::sim::fault_name(kind) << "\n";
  }

  // Writes a line for each pair at which the robot stands in a lift, wagon or escalator.
  static void write_rides(const relmap::sim::PictureWorld& scene, const std::vector<int>& delivered,
                          const fs::path& path) {
    std::ofstream csv = create(path);
    csv << "frame,carried,moving_share\n";
    for (const int i : delivered) {
      if (!scene.riding(i)) continue;
      const std::vector<bool> moving = scene.moving(i);
      const auto count = static_cast<double>(std::count(moving.begin(), moving.end(), true));
      csv << printf_text("%d,%d,%.3f\n", i, scene.carried(i) ? 1 : 0, count / static_cast<double>(moving.size()));
    }
  }

  void render(const relmap::sim::PictureWorld& scene, const fs::path& folder) const {
    struct {
      relmap::Mutex mutex;
      relmap::terminal::ProgressBar progress RELMAP_GUARDED_BY(mutex){std::cerr, relmap::terminal::is_terminal()};
      int done RELMAP_GUARDED_BY(mutex) = 0;
      std::exception_ptr failure RELMAP_GUARDED_BY(mutex);
    } shared;
    std::atomic<int> next = 0;
    const auto work = [&] {
      try {
        for (int i = next++; i < world.frames; i = next++) {
          if (!scene.dropped(i)) {
            const relmap::sim::StereoPictures pair = scene.render(i);
            write_picture(pair.left, folder / "image_0", i);
            write_picture(pair.right, folder / "image_1", i);
          }
          const relmap::MutexLock lock(shared.mutex);
          shared.progress.show("rendering", static_cast<std::uint64_t>(++shared.done),
                               static_cast<std::uint64_t>(world.frames), "pairs");
        }
      } catch (...) {
        next = world.frames;
        const relmap::MutexLock lock(shared.mutex);
        shared.failure = std::current_exception();
      }
    };
    {
      std::vector<std::jthread> workers;
      for (int k = 0; k < threads; ++k) workers.emplace_back(work);
    }
    const relmap::MutexLock lock(shared.mutex);
    if (shared.failure) std::rethrow_exception(shared.failure);
  }

  void write_picture(const relmap::sim::GreyPicture& picture, const fs::path& folder, int i) const {
    const cv::Mat view(picture.height, picture.width, CV_8U, const_cast<std::uint8_t*>(picture.pixels.data()));
    const std::vector<int> how = picture_format == "png" ? std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 1}
                                                         : std::vector<int>{cv::IMWRITE_JPEG_QUALITY, 95};
    const fs::path path = folder / printf_text("%06d.%s", i, picture_format.c_str());
    if (!cv::imwrite(path.string(), view, how)) throw std::runtime_error("cannot write " + path.string());
  }

  std::string description(const SE3& T_world_first) const {
    const StereoCamera& c = world.camera;
    std::vector<double> first;
    for (int row = 0; row < 3; ++row)
      for (const double number :
           {T_world_first.R(row, 0), T_world_first.R(row, 1), T_world_first.R(row, 2), T_world_first.t[row]})
        first.push_back(number);
    return relmap::Json()
        .add("kind", "pictures")
        .add("scene", scene_kind)
        .add("seed", world.seed)
        .add("drive_seed", world.seed_of_drive())
        .add("light", light)
        .add("start_m", world.start)
        .add("pairs", world.frames)
        .add("laps", world.laps)
        .add("step_m", world.step)
        .add("circuit_m", world.circuit_length())
        .add("rate_hz", world.rate)
        .add("start_us", world.start_us)
        .add("camera", relmap::Json()
                           .add("f", c.f)
                           .add("cx", c.cx)
                           .add("cy", c.cy)
                           .add("baseline", c.baseline)
                           .add("width", c.width)
                           .add("height", c.height))
        .add("noise", world.noise)
        .add("exposure_variation", world.exposure_variation)
        .add("lateral_deviation_m", world.lateral_deviation)
        .add("heading_deviation_rad", world.heading_deviation)
        .add("exposure_jumps", world.exposure_jumps)
        .add("exposure_s", world.exposure_s)
        .add("drop_share", world.drop_share)
        .add("ride", ride)
        .add("on_foot", !world.carried)
        .add("faults", faults)
        .add("T_world_first", first)
        .text_lines();
  }
};

struct PointsCommand {
  relmap::sim::PointsWorldOptions world;
  std::string out, shape = "circle";
  bool overwrite = false;

  void add_to(CLI::App& app) {
    CLI::App* c =
        app.add_subcommand("points", "Make the keyframes of a drive through a world of points, without pictures");
    c->footer(
        "Example:\n"
        "  relmap-sim points --out laps --frames 3000 --frames-per-lap 1000\n"
        "Files:\n"
        "  keyframes.bin   for each keyframe: u32 length, little-endian, then its canonical bytes\n"
        "  poses.txt       truth: the frame in the first one's coordinates, 3x4 by rows\n"
        "  sim.json        the options");
    c->add_option("--out", out, "Folder to write")->type_name("FOLDER")->required();
    c->add_option("--seed", world.world_seed, "Seed of the world")->capture_default_str();
    c->add_option("--noise-seed", world.noise_seed, "Seed of the noise of pixels, odometry and descriptors")
        ->capture_default_str();
    c->add_option("--shape", shape, "circle, rectangle, or figure8 (the 288 frames of docs/method.md, 5)")
        ->check(CLI::IsMember({"circle", "rectangle", "figure8"}))
        ->capture_default_str();
    c->add_option("--frames", world.frames, "Number of keyframes")
        ->check(CLI::Range(1U, 100'000'000U))
        ->capture_default_str();
    c->add_option("--frames-per-lap", world.frames_per_lap, "Keyframes in one lap of the circuit")
        ->check(CLI::Range(20U, 100'000'000U))
        ->capture_default_str();
    c->add_option("--appearance", world.appearance, "Features in the appearance of each keyframe; 0: none")
        ->capture_default_str();
    c->add_option("--pixel-noise", world.pixel_noise, "Standard deviation of a measurement, pixels")
        ->capture_default_str();
    c->add_option("--session", world.session, "Name of the session")->capture_default_str();
    c->add_flag("--overwrite", overwrite, "Replace the simulated drive in the folder");
    c->final_callback([this] { run(); });
  }

  void run() {
    if (shape == "figure8") {
      auto figure8 = relmap::sim::figure8_options(world.noise_seed);
      figure8.appearance = world.appearance;
      figure8.session = world.session;
      world = figure8;
    } else if (shape == "rectangle") {
      world.shape = relmap::sim::PlanShape::kRoundedRectangle;
    }
    const fs::path folder = out;
    prepare_folder(folder, overwrite);
    const relmap::sim::PointsWorld points(world);
    const int frames = static_cast<int>(points.size());
    std::ofstream file = create(folder / "keyframes.bin");
    relmap::terminal::ProgressBar progress(std::cerr, relmap::terminal::is_terminal());
    for (int i = 0; i < frames; ++i) {
      relmap::ByteWriter record;
      const relmap::Bytes bytes = relmap::encode_keyframe(points.keyframe(i));
      record.put(static_cast<std::uint32_t>(bytes.size()));
      record.put_bytes(bytes);
      file.write(reinterpret_cast<const char*>(record.bytes().data()), static_cast<std::streamsize>(record.size()));
      progress.show("making", static_cast<std::uint64_t>(i) + 1, static_cast<std::uint64_t>(frames), "keyframes");
    }
    write_poses(folder / "poses.txt", frames, [&](int i) { return points.T_world_frame(i); });
    create(folder / "sim.json") << relmap::Json()
                                       .add("kind", "points")
                                       .add("shape", shape)
                                       .add("seed", world.world_seed)
                                       .add("noise_seed", world.noise_seed)
                                       .add("frames", world.frames)
                                       .add("frames_per_lap", world.frames_per_lap)
                                       .add("step_m", world.step)
                                       .add("appearance", world.appearance)
                                       .add("pixel_noise", world.pixel_noise)
                                       .text_lines();
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Makes drives through simulated worlds from a seed, with exact truth.", "relmap-sim");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  relmap-sim pictures --out drive --seed 1 --pairs 650 --laps 1.3\n"
      "  relmap-sim pictures --out training --seed 11 --pairs 120 --laps 1 --step 0.8\n"
      "  relmap-sim points --out figure8 --shape figure8 --noise-seed 3\n"
      "\n"
      "Exit codes:\n"
      "  0  done\n"
      "  1  failed; the reason is printed\n"
      "  2  wrong usage");
  relmap::terminal::add_standard_options(app);
  PicturesCommand pictures;
  PointsCommand points;
  pictures.add_to(app);
  points.add_to(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return relmap::terminal::end_with(app, error, std::cout, std::cerr, 2);
  } catch (const std::exception& error) {
    std::cerr << "relmap-sim: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
