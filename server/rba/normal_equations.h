// The reduced normal equations of a relative bundle adjustment, at the cost of an ordinary one (docs/method.md, 3).
//
// Sibley et al. 2010 (algorithm 1) build a Jacobian for each measurement and each edge of its chain. This code instead
// computes, for each base j:
//   1. the ordinary reduced system over theta_i, the perturbations T_ij <- T_ij Exp(theta_i) of its observers:
//        V = L L' = sum H' w H,   Y_i = E' (w H_i' G_i)' L^-T,   M_ik = delta_ik E' (w G_i' G_i) E - Y_i Y_k',
//      with H the landmark's Jacobian, and G and E of measurement.h. H shares two of its columns with G, so a
//      measurement adds only G'G and the products of H's third column;
//   2. M summed over the descendants of each moving edge in j's path tree, since theta_i = sum_c S_c xi_c over the
//      moving edges c on the path, and S_c does not depend on i;
//   3. one product S_p' M_pq S_q for each pair of moving edges, added to A.
// Observers that share their last moving edge share theta, so M has one row of blocks per moving edge, not per frame.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/rba/problem.h"
#include "server/rba/reduced_system.h"

namespace relmap::rba {

using Matrix63 = Eigen::Matrix<double, 6, 3>;

// Reusable for one problem after another. It allocates only for a problem that is larger than all before, or sparse.
class NormalEquations {
 public:
  // Reads the problem's structure (trees, columns), which must not change until the next reset(); its numbers may.
  void reset(const Problem& problem);

  // Linearises at the problem's present state and damps the landmarks' blocks: V <- V + lambda diag(V). `huber` is the
  // corner of Huber's loss in sigmas; `poses` come from problem.compose(). False if a landmark's block is singular.
  bool assemble(const Problem& problem, const std::vector<SE3>& poses, double huber, double lambda);

  // The reduced system A dxi = b, not damped, with one row of blocks for each column of the problem.
  ReducedSystem& system() { return system_; }
  // Measurements linearised by one assemble().
  std::uint64_t observations() const { return observations_; }

  // Computes the step of each landmark of the problem, zero where it is held, from the step of the edges.
  void back_substitute(const Problem& problem, const std::vector<Vector6>& dxi, std::vector<Vector3>* dl);

 private:
  // A moving edge in a base's tree.
  struct Group {
    std::int32_t column = 0;
    std::int32_t parent = -1;  // the moving edge before it on the path, within the base; -1: none
    std::int32_t node = 0;     // the node that the edge leads to
    Matrix6 S;
  };
  struct BaseGroups {
    std::int32_t first = 0, end = 0;  // in groups_
  };
  // Sums over the observers of one landmark beyond one moving edge.
  struct Sums {
    std::int32_t group = 0;  // within the base
    Matrix3 N;               // w G' G
    Vector3 c;               // w G' h, h the third column of H
    Vector3 g;               // w G' r
  };
  // The part of Sums that is kept for back substitution once the landmark is eliminated.
  struct Slot {
    std::int32_t group = 0;
    Matrix63 Y;
  };
  struct LandmarkBlock {
    Matrix3 L_inverse;  // V = L L'
    Vector3 u;          // L^-1 (w H' r)
    std::int32_t first_slot = 0, end_slot = 0;
  };

  bool eliminate(const Problem& problem, const std::vector<SE3>& poses, std::int32_t landmark, double huber,
                 double lambda, std::int32_t groups);
  // Adds the measurements of a held landmark. False if a counted point is not in front of its camera.
  bool add_held(const Problem& problem, const std::vector<SE3>& poses, std::int32_t landmark, double huber,
                std::int32_t groups);
  // Adds E' N E to the diagonal block of a moving edge, and E' g to its right side.
  void add_own(const Sums& sums, const Vector3& abr, std::int32_t groups);
  // Sums the landmark's measurements by the last moving edge on their path, in sums_; the first element holds those
  // without one. `v` and `r2` are the sums of w h'h and w h'r. False if a counted point is not in front of its camera.
  bool sum_measurements(const Problem& problem, const std::vector<SE3>& poses, const ProblemLandmark& point,
                        double huber, double* v, double* r2);
  void sum_over_descendants(const BaseGroups& base);
  void add_to_system(const BaseGroups& base);
  void add_priors(const Problem& problem, double huber);

  std::vector<BaseGroups> bases_;
  std::vector<Group> groups_;
  std::vector<std::int32_t> group_of_node_;  // within the base; -1: no moving edge on the path
  std::vector<LandmarkBlock> landmarks_;
  std::vector<Slot> slots_;
  std::vector<Sums> sums_;  // of the landmark being assembled
  std::vector<Matrix6> M_;  // upper triangle, row by row: M_[in_triangle(groups, p, q)], p <= q
  std::vector<Vector6> m_;
  std::vector<Vector6> theta_;  // used by back_substitute()
  ReducedSystem system_;
  std::uint64_t observations_ = 0;
};

// Twice the negative log-likelihood, under Huber's loss, of the counted measurements, the depth priors of free
// landmarks and the priors of moving edges. Infinity if a counted point is not in front of its camera.
double true_cost(const Problem& problem, const std::vector<SE3>& poses, double huber);

}  // namespace relmap::rba
