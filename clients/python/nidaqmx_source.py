"""Analog inputs of a DAQ card of National Instruments as a source of taxel (pip install nidaqmx, with NI's driver).

    taxel live SENSOR --board card.toml --source exec:"python3 nidaqmx_source.py Dev1/ai0:3 --rate 1000"

The board file is that of clients/python/README.md with `{value c1..c4 V}`. Tried with the interface of the library alone, not
with a card.
"""

import argparse
import sys

from taxel_source import Source, say


def main():
    import nidaqmx
    from nidaqmx.constants import AcquisitionType

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("channels", help="physical channels, such as Dev1/ai0:3")
    parser.add_argument("--rate", type=float, default=1000.0, help="samples a second")
    arguments = parser.parse_args()
    source, number = Source(), 0
    # As many as come in a hundredth of a second, at least one: what waits is late.
    together = max(1, round(arguments.rate / 100))
    with nidaqmx.Task() as task:
        task.ai_channels.add_ai_voltage_chan(arguments.channels)
        task.timing.cfg_samp_clk_timing(arguments.rate, sample_mode=AcquisitionType.CONTINUOUS)
        say(f"{arguments.channels}: {len(task.ai_channels)} channels at {arguments.rate} Hz")
        while True:
            columns = task.read(number_of_samples_per_channel=together)
            # Of one channel the library gives the samples alone.
            columns = columns if len(task.ai_channels) > 1 else [columns]
            for sample in zip(*columns):
                source.send(sample, number / arguments.rate, number)
                number += 1


if __name__ == "__main__":
    sys.exit(main())
