// The reversal of peer_reversal.rs by Ceres: same model, same minimum.
//
//     reversal <file> <threads> <function tolerance> <weight of the gauge>
//
// Unknowns: all coefficients of three cubic splines on the same knots (a parameter block each),
// three tilts, four offsets. One residual block a channel and cell of the slide's form, which is the
// fastest way seen; analytic derivatives; SPARSE_NORMAL_CHOLESKY. The gauge (the least-squares line
// of every form over the measured positions is zero) is two residuals a form of a weight so large
// that what is left of it does not show in the cost. Prints seconds, seconds of all processors, peak memory (MB), half the sum
// of squares of the residuals (um^2), iterations, tilts (rad).

#include <ceres/ceres.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

namespace {

using Cubic = std::array<double, 4>;

// Signs of M (and of the first tilt) and of the second tilt; their product is that of the third.
constexpr int kSigns[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};

struct Basis {
  double low, high;
  int cells;
  std::vector<std::array<Cubic, 4>> functions;

  double Break(int j) const {
    return low + (high - low) * std::clamp(j, 0, cells) / cells;
  }
  double Width(int cell) const { return Break(cell + 1) - Break(cell); }
  int CellOf(double x) const {
    int k = std::clamp(int((x - low) / (high - low) * cells), 0, cells - 1);
    while (k > 0 && x < Break(k)) --k;
    while (k + 1 < cells && x >= Break(k + 1)) ++k;
    return k;
  }

  // De Boor's recurrence on polynomials of t = (x - left)/width.
  Basis(double low, double high, int cells) : low(low), high(high), cells(cells) {
    for (int cell = 0; cell < cells; ++cell) {
      const double left = Break(cell), width = Width(cell);
      std::array<Cubic, 4> f{};
      f[0][0] = 1;
      for (int degree = 1; degree <= 3; ++degree) {
        std::array<Cubic, 4> next{};
        for (int r = 0; r < degree; ++r) {
          const double from = Break(cell + r - degree + 1), to = Break(cell + r + 1);
          const double a = (left - from) / (to - from), b = width / (to - from);
          for (int power = 0; power < degree; ++power) {
            const double v = f[r][power];
            next[r + 1][power] += a * v;
            next[r + 1][power + 1] += b * v;
            next[r][power] += (1 - a) * v;
            next[r][power + 1] -= b * v;
          }
        }
        f = next;
      }
      functions.push_back(f);
    }
  }
};

double Value(const Cubic& p, double t) { return ((p[3] * t + p[2]) * t + p[1]) * t + p[0]; }
double Slope(const Cubic& p, double t) { return (3 * p[3] * t + 2 * p[2]) * t + p[1]; }

// The readings of a channel in one cell of the slide's form. Parameters: four coefficients of M, six
// of the artefact's form (the points of contact may lie in the cells beside), tilts, offset.
class Block : public ceres::CostFunction {
 public:
  Block(const Basis* basis, int channel, int cell, const double* x, const double* y, int n,
        double half)
      : basis_(basis), i_(kSigns[channel][0]), s_(kSigns[channel][1]), cell_(cell),
        first_(std::clamp(cell - 1, 0, std::max(0, basis->cells - 3))), x_(x), y_(y), half_(half) {
    side_count_ = std::min(6, basis->cells + 3);
    set_num_residuals(n);
    for (int k = 0; k < 4 + side_count_; ++k) mutable_parameter_block_sizes()->push_back(1);
    mutable_parameter_block_sizes()->push_back(3);
    mutable_parameter_block_sizes()->push_back(1);
  }
  int first_side() const { return first_; }
  int side_count() const { return side_count_; }

  bool Evaluate(double const* const* p, double* r, double** jacobians) const override {
    const int sides = side_count_, tilts = 4 + sides, offset = tilts + 1;
    const double psi = i_ * p[tilts][0] + s_ * p[tilts][1] + i_ * s_ * p[tilts][2];
    const double sin = std::sin(psi), cos = std::cos(psi);
    const double versed = 2 * std::pow(std::sin(psi / 2), 2);
    const auto& slide = basis_->functions[cell_];
    Cubic m{};
    for (int k = 0; k < 4; ++k)
      for (int power = 0; power < 4; ++power) m[power] += p[k][0] * slide[k][power];
    std::array<Cubic, 3> forms{};
    const int cells = std::min(3, basis_->cells);
    for (int c = 0; c < cells; ++c)
      for (int k = 0; k < 4; ++k)
        for (int power = 0; power < 4; ++power)
          forms[c][power] += p[4 + c + k][0] * basis_->functions[first_ + c][k][power] / 1000;
    for (int n = 0; n < num_residuals(); ++n) {
      double u = (x_[n] + half_ * sin) / cos, height = 0, slope = 0, t = 0;
      int c = 0;
      for (int step = 0; step < 20; ++step) {
        c = std::clamp(basis_->CellOf(u) - first_, 0, cells - 1);
        const double width = basis_->Width(first_ + c);
        t = (u - basis_->Break(first_ + c)) / width;
        height = Value(forms[c], t);
        slope = Slope(forms[c], t) / width;
        const double move =
            (x_[n] - u * cos + (half_ + height) * sin) / (cos - slope * sin);
        if (std::abs(move) < 1e-13 * basis_->high) break;
        u += move;
      }
      const double at = (x_[n] - basis_->Break(cell_)) / basis_->Width(cell_);
      r[n] = 1000 * (u * sin + height * cos - half_ * versed) + i_ * Value(m, at) +
             p[offset][0] - y_[n];
      if (jacobians == nullptr) continue;
      const double q = 1 / (cos - slope * sin);
      for (int k = 0; k < 4; ++k)
        if (jacobians[k]) jacobians[k][n] = i_ * Value(slide[k], at);
      for (int k = 0; k < sides; ++k) {
        if (!jacobians[4 + k]) continue;
        const int l = k - c;
        jacobians[4 + k][n] =
            l >= 0 && l < 4 ? q * Value(basis_->functions[first_ + c][l], t) : 0;
      }
      if (jacobians[tilts]) {
        const double across = u * sin + (half_ + height) * cos;
        const double turn = 1000 * (x_[n] + (sin + slope * cos) * across * q);
        jacobians[tilts][3 * n] = i_ * turn;
        jacobians[tilts][3 * n + 1] = s_ * turn;
        jacobians[tilts][3 * n + 2] = i_ * s_ * turn;
      }
      if (jacobians[offset]) jacobians[offset][n] = 1;
    }
    return true;
  }

 private:
  const Basis* basis_;
  int i_, s_, cell_, first_, side_count_;
  const double *x_, *y_;
  double half_;
};

// The two parameters of the least-squares line of a form, times a weight.
class Gauge : public ceres::CostFunction {
 public:
  explicit Gauge(const std::vector<double>* rows) : rows_(rows) {
    set_num_residuals(2);
    for (size_t k = 0; k < rows->size() / 2; ++k) mutable_parameter_block_sizes()->push_back(1);
  }
  bool Evaluate(double const* const* p, double* r, double** jacobians) const override {
    const size_t count = rows_->size() / 2;
    r[0] = r[1] = 0;
    for (size_t k = 0; k < count; ++k) {
      for (int l = 0; l < 2; ++l) {
        const double w = (*rows_)[l * count + k];
        r[l] += w * p[k][0];
        if (jacobians && jacobians[k]) jacobians[k][l] = w;
      }
    }
    return true;
  }

 private:
  const std::vector<double>* rows_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 1;
  std::ifstream file(argv[1], std::ios::binary | std::ios::ate);
  std::vector<double> data(file.tellg() / sizeof(double));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(data.data()), data.size() * sizeof(double));
  const int n = int(data[0]), cells = int(data[1]);
  const Basis basis(data[2], data[3], cells);
  const double half = data[4] / 2;
  double tilts[3] = {data[5], data[6], data[7]};
  double offsets[4] = {data[8], data[9], data[10], data[11]};
  const double* traces = data.data() + 12;
  const int k = cells + 3;
  std::vector<double> forms(3 * k, 0.0);

  const std::clock_t used = std::clock();
  const auto began = std::chrono::steady_clock::now();
  double sum = 0, least = 1e300, most = -1e300;
  for (int c = 0; c < 4; ++c)
    for (int j = 0; j < n; ++j) {
      const double x = traces[2 * c * n + j];
      sum += x;
      least = std::min(least, x);
      most = std::max(most, x);
    }
  const double center = sum / (4.0 * n), scale = (most - least) / 2;
  const double weight = std::atof(argv[4]) * std::sqrt(n / 2000.0);
  std::vector<double> gauge(2 * k, 0.0);
  ceres::Problem problem;
  std::vector<ceres::ResidualBlockId> readings;
  for (int c = 0; c < 4; ++c) {
    const double *x = traces + 2 * c * n, *y = x + n;
    const int side = kSigns[c][0] * kSigns[c][1] > 0 ? 1 : 2;
    for (int from = 0; from < n;) {
      const int cell = basis.CellOf(x[from]);
      int to = from;
      while (to < n && basis.CellOf(x[to]) == cell) {
        const double t = (x[to] - basis.Break(cell)) / basis.Width(cell);
        for (int l = 0; l < 4; ++l) {
          const double b = weight * Value(basis.functions[cell][l], t) / (4.0 * n);
          gauge[cell + l] += b;
          gauge[k + cell + l] += b * (x[to] - center) / scale;
        }
        ++to;
      }
      auto* block = new Block(&basis, c, cell, x + from, y + from, to - from, half);
      std::vector<double*> parameters;
      for (int l = 0; l < 4; ++l) parameters.push_back(&forms[cell + l]);
      for (int l = 0; l < block->side_count(); ++l)
        parameters.push_back(&forms[side * k + block->first_side() + l]);
      parameters.push_back(tilts);
      parameters.push_back(&offsets[c]);
      readings.push_back(problem.AddResidualBlock(block, nullptr, parameters));
      from = to;
    }
  }
  for (int form = 0; form < 3; ++form) {
    std::vector<double*> parameters;
    for (int l = 0; l < k; ++l) parameters.push_back(&forms[form * k + l]);
    problem.AddResidualBlock(new Gauge(&gauge), nullptr, parameters);
  }

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = std::atoi(argv[2]);
  options.max_num_iterations = 200;
  options.function_tolerance = std::atof(argv[3]);
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - began;
  const double processor = double(std::clock() - used) / CLOCKS_PER_SEC;
  double cost = 0;
  ceres::Problem::EvaluateOptions of_readings;
  of_readings.residual_blocks = readings;
  problem.Evaluate(of_readings, &cost, nullptr, nullptr, nullptr);
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  std::printf("ceres %.4f %.4f %.1f %.16e %d %.13e %.13e %.13e\n", seconds.count(), processor,
              usage.ru_maxrss / 1024.0, cost, int(summary.iterations.size()), tilts[0], tilts[1],
              tilts[2]);
}
