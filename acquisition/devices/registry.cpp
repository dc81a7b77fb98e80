// A new tracker:
// 1. acquisition/protocols/<id>: commands to bytes, and a StreamParser that turns bytes into readings; no I/O.
// 2. acquisition/emulators/<id>: the device side over EmulatedUnit, so that it can be tested without hardware.
// 3. acquisition/devices/<id>_device: its settings, and the TrackerStartup that brings it to a stream; LineDevice has
//    the line, the clock, the watching and the farewell. Its parser is made from text, so that a trace can make it
//    again.
// 4. One row below, with the probe by which it is found on a line. Menus, command line and the contract test read the
// table.
#include "acquisition/devices/registry.h"

#include <algorithm>
#include <cmath>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/devices/flock_device.h"
#include "acquisition/devices/isotrak_device.h"
#include "acquisition/devices/liberty_device.h"
#include "acquisition/devices/ndi_device.h"
#include "acquisition/devices/openigtlink_device.h"
#include "acquisition/devices/simulated_device.h"
#include "acquisition/devices/trace_device.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/emulators/flock_emulator.h"
#include "acquisition/emulators/isotrak_emulator.h"
#include "acquisition/emulators/liberty_emulator.h"
#include "acquisition/emulators/ndi_emulator.h"
#include "acquisition/emulators/openigtlink_emulator.h"
#include "acquisition/transports/serial_ports.h"

namespace fieldtrue::acquisition {
namespace {

Result<std::unique_ptr<TrackerDevice>> makeSimulated(const std::string& address, const simulation::Scene& scene) {
  FT_TRY(auto settings, readDeviceSettings("simulated", simulatedSettings(), address));
  FT_TRY(auto setup, simulatedSetup(settings));
  return SimulatedDevice::make(scene, setup);
}

}  // namespace

std::span<const DeviceKind> deviceKinds() {
  static const std::vector<DeviceKind> kKinds = {
      {.id = "simulated",
       .label = "Simulated tracker",
       .address_help = "nothing, or settings: simulated:speed=4,seed=2,travel_s=1",
       .source = "A simulated tracker in a scene, with an operator who carries the jig",
       .settings = simulatedSettings(),
       // sqrt(1/54 + 10/9) sigma r^4, of the default scene's couplings, sigma = 2e-4: radial and transverse SDs of
       // noise_law.h.
       .noise = TypicalNoise{1.72e-6, 0.3},
       .make = makeSimulated},
      {.id = "fastrak",
       .label = "Polhemus Fastrak",
       .address_help = "the line, then settings: fastrak:/dev/ttyUSB0@115200, fastrak:tcp:localhost:4000,hemisphere=-x",
       .source = "3SPACE Fastrak manual OPM00PI002 rev. G",
       .settings = fastrakSettings(),
       .probe = fastrakProbe(),
       // Data sheet: 0.0002 of the range, here at 30 inches.
       .noise = TypicalNoise{1.5e-4, 0.76},
       .make = makeFastrak,
       .stream = fastrakStream,
       .emulate = makeFastrakEmulator},
      {.id = "isotrak",
       .label = "Polhemus Isotrak II",
       .address_help = "the line, then settings: isotrak:/dev/ttyUSB0@19200, isotrak:tcp:localhost:4000,stations=1+2",
       .source = "Isotrak II manual OPM01PI021, 2001 edition; VRPN's driver",
       .settings = isotrakSettings(),
       .probe = isotrakProbe(),
       .make = makeIsotrak,
       .stream = isotrakStream,
       .emulate = makeIsotrakEmulator},
      {.id = "liberty",
       .label = "Polhemus Liberty",
       .address_help = "the line, then settings: liberty:/dev/ttyUSB0@115200, liberty:tcp:localhost:4000,stations=1+2",
       .source = "Liberty manual URM03PH156 rev. H",
       .settings = libertySettings(),
       .probe = libertyProbe(),
       // Data sheet: 0.0012 mm at 30 cm.
       .noise = TypicalNoise{1.2e-6, 0.3},
       .make = makeLiberty,
       .stream = libertyStream,
       .emulate = makeLibertyEmulator},
      {.id = "patriot",
       .label = "Polhemus Patriot",
       .address_help = "the line, then settings: patriot:/dev/ttyUSB0@115200, patriot:tcp:localhost:4000,hemisphere=-x",
       .source = "Patriot manual URM03PH170 rev. G",
       .settings = patriotSettings(),
       .probe = patriotProbe(),
       // Data sheet: 0.00046 inches at 12.
       .noise = TypicalNoise{1.17e-5, 0.305},
       .make = makePatriot,
       .stream = patriotStream,
       .emulate = makePatriotEmulator},
      {.id = "flock",
       .label = "Ascension Flock of Birds",
       .address_help = "the line, then settings: flock:/dev/ttyUSB0@115200, flock:/dev/ttyUSB0,stations=1+2,range=144",
       .source = "Flock of Birds installation and operation guide; VRPN's and VR Juggler's drivers",
       .settings = flockSettings(),
       .probe = flockProbe(),
       .make = makeFlock,
       .stream = flockStream,
       .emulate = makeFlockEmulator},
      {.id = "ndi",
       .label = "NDI Aurora, Polaris, Vega",
       .address_help = "the line, then settings: ndi:/dev/ttyUSB0@115200, ndi:tcp:192.168.1.10:8765,rom=probe.rom",
       .source = "NDI's combined API as the open ndicapi speaks it",
       .settings = ndiSettings(),
       .probe = ndiProbe(),
       .make = makeNdi,
       .stream = ndiStream,
       .emulate = makeNdiEmulator},
      {.id = "openigtlink",
       .label = "OpenIGTLink server",
       .address_help = "host and port, then settings: openigtlink:localhost:18944,devices=Probe+Stylus",
       .source = "openigtlink.org, protocol versions 1 to 3",
       .settings = openigtlinkSettings(),
       .usual_addresses = {"localhost:18944"},
       .probe = openigtlinkProbe(),
       .make = makeOpenigtlink,
       .stream = openigtlinkStream,
       .emulate = makeIgtlEmulator},
      {.id = "trace",
       .label = "A recording, played again",
       .address_help = "the file, then settings: trace:fault.trace.zip, trace:room.samples.csv,rate=4,loop=1",
       .source = "What acquire --trace wrote, or a sample table",
       .settings = traceSettings(),
       .make = makeTraceDevice}};
  return kKinds;
}

Result<const DeviceKind*> findEmulated(const std::string& id) {
  std::string known;
  for (const DeviceKind& kind : deviceKinds()) {
    if (!kind.emulate) continue;
    if (kind.id == id) return &kind;
    known += (known.empty() ? "" : ", ") + kind.id;
  }
  return fail(ErrorCode::kBadInput, "no emulator is called '" + id + "'; known: " + known);
}

std::optional<double> expectedNoise_m(const std::string& kind, double range_m) {
  for (const DeviceKind& row : deviceKinds()) {
    if (row.id == kind && row.noise)
      return row.noise->sd_m * std::pow(std::max(1.0, range_m / row.noise->range_m), 4.0);
  }
  return std::nullopt;
}

Result<DeviceAddress> parseDevice(const std::string& text) {
  const std::size_t colon = text.find(':');
  DeviceAddress device{text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 1)};
  if (device.kind.empty()) {
    return fail(ErrorCode::kBadInput, "No device is named; write e.g. simulated or fastrak:/dev/ttyUSB0@115200");
  }
  return device;
}

Result<std::unique_ptr<TrackerDevice>> makeDevice(const std::string& text, const simulation::Scene& scene) {
  FT_TRY(auto device, parseDevice(text));
  std::string known;
  for (const auto& kind : deviceKinds()) {
    if (kind.id == device.kind) return kind.make(device.address, scene);
    known += (known.empty() ? "" : ", ") + kind.id;
  }
  return fail(ErrorCode::kBadInput, "\"" + device.kind + "\" is not a known device; known are " + known);
}

std::vector<SerialLine> serialLines() {
  std::vector<SerialLine> lines;
  for (const auto& port : listSerialPorts()) lines.push_back({port.path, port.description});
  return lines;
}

}  // namespace fieldtrue::acquisition
