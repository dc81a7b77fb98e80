// What the search for lines in single readings finds: in noise that has none, and of a line of rising amplitude; and
// what half and double of each of its figures do to both.
//
//   lines_study [--repeats N]
//
// Noise is made here, apart from that of the tests: by recursions, and powers of the frequency by
// a Fourier series of random coefficients (Timmer and Koenig 1995, Astron. Astrophys. 300 707).
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>
#include <span>
#include <string>

#include "calib/recording/sample_spectrum.h"

using namespace fieldtrue;
using recording::LineRules;
using recording::SampleVisit;

namespace {

constexpr double kRate_hz = 120.0;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

using Series = std::vector<double>;

class Noise {
 public:
  explicit Noise(unsigned seed) : generator_(seed) {}

  double one() { return normal_(generator_); }
  double phase() { return std::uniform_real_distribution<double>(0.0, kTwoPi)(generator_); }

  Series white(std::size_t n, double sd = 1.0) {
    Series values(n);
    for (double& value : values) value = sd * one();
    return values;
  }

  /// x_k = sum of a_j x_(k-j), and e_k + sum of m_j e_(k-j).
  Series recursion(std::span<const double> a, std::span<const double> m, std::size_t n, double sd = 1.0) {
    constexpr std::size_t kBefore = 600;
    const Series e = white(n + kBefore, sd);
    Series x = e;
    for (std::size_t k = 0; k < x.size(); ++k) {
      for (std::size_t j = 0; j < a.size() && j < k; ++j) x[k] += a[j] * x[k - 1 - j];
      for (std::size_t j = 0; j < m.size() && j < k; ++j) x[k] += m[j] * e[k - 1 - j];
    }
    return {x.begin() + kBefore, x.end()};
  }

  Series firstOrder(double rho, std::size_t n) {
    const std::vector<double> a = {rho};
    return recursion(a, {}, n, std::sqrt(1.0 - rho * rho));
  }

  Series walk(double step, std::size_t n) {
    Series values = white(n, step);
    for (std::size_t k = 1; k < n; ++k) values[k] += values[k - 1];
    return values;
  }

  /// Power falls by the exponent of the frequency; a part of a period of 2048 readings.
  Series power(double exponent, std::size_t n) {
    constexpr int kPeriod = 2048;
    Series values(n, 0.0);
    for (int k = 1; k <= kPeriod / 2; ++k) {
      const double size = std::pow(static_cast<double>(k) / kPeriod, -0.5 * exponent) * std::sqrt(2.0 / kPeriod);
      const double c = size * one(), s = size * one();
      for (std::size_t i = 0; i < n; ++i) {
        const double turn = kTwoPi * k * static_cast<double>(i) / kPeriod;
        values[i] += c * std::cos(turn) + s * std::sin(turn);
      }
    }
    return values;
  }

  /// Second order with its poles at a frequency: a hump.
  Series hump(double frequency_hz, double radius, std::size_t n, double sd) {
    const std::vector<double> a = {2.0 * radius * std::cos(kTwoPi * frequency_hz / kRate_hz), -radius * radius};
    return recursion(a, {}, n, sd);
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

Series plus(Series a, const Series& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

struct Kind {
  std::string name;
  std::function<Series(Noise&, std::size_t)> make;
};

const std::vector<double> kArma21 = {1.2, -0.4}, kArma21Moving = {0.5};
const std::vector<double> kArma22 = {1.5, -0.6}, kArma22Moving = {-0.4, 0.3};

const std::vector<Kind> kKinds = {
    {"white", [](Noise& r, std::size_t n) { return r.white(n); }},
    {"first order 0.5", [](Noise& r, std::size_t n) { return r.firstOrder(0.5, n); }},
    {"first order 0.9", [](Noise& r, std::size_t n) { return r.firstOrder(0.9, n); }},
    {"first order 0.98", [](Noise& r, std::size_t n) { return r.firstOrder(0.98, n); }},
    {"first order 0.8, white 0.5", [](Noise& r, std::size_t n) { return plus(r.firstOrder(0.8, n), r.white(n, 0.5)); }},
    {"first order 0.97, white 1", [](Noise& r, std::size_t n) { return plus(r.firstOrder(0.97, n), r.white(n)); }},
    {"first order 0.99, white 2", [](Noise& r, std::size_t n) { return plus(r.firstOrder(0.99, n), r.white(n, 2.0)); }},
    {"f^-0.5", [](Noise& r, std::size_t n) { return r.power(0.5, n); }},
    {"f^-1", [](Noise& r, std::size_t n) { return r.power(1.0, n); }},
    {"f^-2", [](Noise& r, std::size_t n) { return r.power(2.0, n); }},
    {"f^-1, white 2", [](Noise& r, std::size_t n) { return plus(r.power(1.0, n), r.white(n, 2.0)); }},
    {"walk 0.1, white 0.3", [](Noise& r, std::size_t n) { return plus(r.walk(0.1, n), r.white(n, 0.3)); }},
    {"walk 0.3, white 1", [](Noise& r, std::size_t n) { return plus(r.walk(0.3, n), r.white(n)); }},
    {"ARMA(2,1)", [](Noise& r, std::size_t n) { return r.recursion(kArma21, kArma21Moving, n); }},
    {"ARMA(2,2)", [](Noise& r, std::size_t n) { return r.recursion(kArma22, kArma22Moving, n); }},
    {"hump at 23 Hz", [](Noise& r, std::size_t n) { return r.hump(23.0, 0.85, n, 0.5); }},
    {"hump at 5 Hz, white 0.5",
     [](Noise& r, std::size_t n) { return plus(r.hump(5.0, 0.85, n, 0.5), r.white(n, 0.5)); }},
};

struct Size {
  std::size_t stops;
  std::size_t readings;
};
constexpr Size kSizes[] = {{8, 60}, {24, 60}, {60, 60}, {8, 120}, {24, 120}, {60, 120}, {24, 240}};

struct Line {
  double frequency_hz = 0.0;
  double amplitude = 0.0;
};

std::vector<SampleVisit> recorded(const Kind& kind, const Size& size, const Line& line, unsigned seed) {
  Noise noise(seed);
  std::vector<SampleVisit> visits;
  for (std::size_t stop = 0; stop < size.stops; ++stop) {
    SampleVisit visit;
    visit.node = static_cast<int>(stop);
    visit.deviations.resize(static_cast<Eigen::Index>(size.readings), 6);
    for (std::size_t i = 0; i < size.readings; ++i)
      visit.times_s.push_back(10.0 * static_cast<double>(stop) + static_cast<double>(i) / kRate_hz);
    const double phase = noise.phase();
    for (Eigen::Index channel = 0; channel < 6; ++channel) {
      const Series values = kind.make(noise, size.readings);
      for (std::size_t i = 0; i < size.readings; ++i) {
        const double turn = kTwoPi * line.frequency_hz * static_cast<double>(i) / kRate_hz + phase;
        visit.deviations(static_cast<Eigen::Index>(i), channel) = 5e-4 * (values[i] + line.amplitude * std::sin(turn));
      }
    }
    visit.deviations.rowwise() -= visit.deviations.colwise().mean().eval();
    visits.push_back(std::move(visit));
  }
  return visits;
}

unsigned seedOf(int repeat, const Size& size) {
  return static_cast<unsigned>(1000003 * repeat + 7919 * static_cast<int>(size.readings + 31 * size.stops) + 1);
}

/// Recordings of noise, of all kinds and sizes, in which a line is seen.
struct Alarms {
  int seen = 0;
  int of = 0;
};

Alarms alarmsIn(const Kind& kind, const LineRules& rules, int repeats) {
  Alarms alarms;
  for (const Size& size : kSizes) {
    for (int k = 0; k < repeats; ++k) {
      const auto spectrum = recording::sampleSpectrum(recorded(kind, size, {}, seedOf(k, size)), {}, rules);
      alarms.seen += spectrum && !spectrum->lines.empty() ? 1 : 0;
      ++alarms.of;
    }
  }
  return alarms;
}

bool isFound(const Kind& kind, const Size& size, const Line& line, const LineRules& rules, int repeat) {
  const auto spectrum = recording::sampleSpectrum(recorded(kind, size, line, seedOf(repeat, size)), {}, rules);
  const double near_hz = 0.75 * kRate_hz / static_cast<double>(std::min<std::size_t>(size.readings, 128));
  for (const recording::SpectralLine& found : spectrum->lines)
    if (std::abs(found.frequency_hz - line.frequency_hz) < near_hz) return true;
  return false;
}

/// The smallest amplitude, in SDs of the white or first-order noise, that is found in nine of ten recordings.
double smallestFound(const Kind& kind, const Size& size, double frequency_hz, const LineRules& rules, int repeats) {
  for (double amplitude = 0.05; amplitude < 8.0; amplitude *= 1.15) {
    int found = 0;
    for (int k = 0; k < repeats; ++k) found += isFound(kind, size, {frequency_hz, amplitude}, rules, k) ? 1 : 0;
    if (10 * found >= 9 * repeats) return amplitude;
  }
  return std::nan("");
}

struct Figure {
  const char* name;
  double LineRules::*value;
};
constexpr Figure kFigures[] = {{"largest_chance", &LineRules::largest_chance},
                               {"least_excess", &LineRules::least_excess},
                               {"least_low_excess", &LineRules::least_low_excess},
                               {"least_lowest_excess", &LineRules::least_lowest_excess}};
constexpr double kFrequencies_hz[] = {5.0, 10.0, 15.0, 50.0};

void printLimits(const LineRules& rules, int repeats) {
  std::printf("\n| noise | stops x readings |");
  for (const double frequency_hz : kFrequencies_hz) std::printf(" %g Hz |", frequency_hz);
  std::printf("\n|---|---|---|---|---|---|\n");
  for (const std::size_t kind : {0, 2, 5}) {
    for (const Size& size : kSizes) {
      std::printf("| %s | %zu x %zu |", kKinds[kind].name.c_str(), size.stops, size.readings);
      for (const double frequency_hz : kFrequencies_hz)
        std::printf(" %.2f |", smallestFound(kKinds[kind], size, frequency_hz, rules, repeats));
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

void printRow(const char* name, double value, const LineRules& rules, int repeats) {
  Alarms all;
  std::string where;
  for (const Kind& kind : kKinds) {
    const Alarms alarms = alarmsIn(kind, rules, repeats);
    all.seen += alarms.seen;
    all.of += alarms.of;
    if (alarms.seen > 0) where += (where.empty() ? "" : ", ") + kind.name + " " + std::to_string(alarms.seen);
  }
  std::printf("| %s | %g | %d of %d%s |", name, value, all.seen, all.of,
              where.empty() ? "" : (" (" + where + ")").c_str());
  for (const double frequency_hz : kFrequencies_hz)
    std::printf(" %.2f |", smallestFound(kKinds.front(), {24, 60}, frequency_hz, rules, repeats));
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int repeats = argc > 2 && std::string(argv[1]) == "--repeats" ? std::max(1, std::atoi(argv[2])) : 10;
  std::printf("| figure | value | lines in noise | 5 Hz | 10 Hz | 15 Hz | 50 Hz |\n|---|---|---|---|---|---|---|\n");
  printRow("as it is", 0.0, {}, repeats);
  for (const Figure& figure : kFigures) {
    for (const double factor : {0.5, 2.0}) {
      LineRules rules;
      rules.*figure.value *= factor;
      printRow(figure.name, rules.*figure.value, rules, repeats);
    }
  }
  printLimits({}, repeats);
  return 0;
}
