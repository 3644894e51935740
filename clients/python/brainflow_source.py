"""A board of BrainFlow as a source of taxel (pip install brainflow).

    taxel live --raw --board brainflow.toml --source exec:"python3 brainflow_source.py --board -1"

Sends the rows that `--rows` names (eeg, emg, analog, accel, …) with the times and numbers of the board. It prints the board file to
the standard error with --board-file, and ends. Board -1 is BrainFlow's synthetic one.
"""

import argparse
import sys
import time

from taxel_source import Source, say

BOARD = """schema = 1
name = "BrainFlow {name}"
rate = "{rate} Hz"

[framing.lines]
template = '{{{{"t":{{time s}},"n":{{sequence}},"v":[{{value c1..c{count}}}]}}}}'
"""


def main():
    from brainflow.board_shim import BoardShim, BrainFlowInputParams

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--board", type=int, default=-1, help="number of the board in BrainFlow")
    parser.add_argument("--port", default="", help="serial port, where the board has one")
    parser.add_argument("--rows", default="eeg", help="which rows of its data: eeg, emg, analog, accel, …")
    parser.add_argument("--board-file", action="store_true", help="print the board file and end")
    arguments = parser.parse_args()
    BoardShim.disable_board_logger()
    board = arguments.board
    rows = getattr(BoardShim, f"get_{arguments.rows}_channels")(board)
    rate, clock = BoardShim.get_sampling_rate(board), BoardShim.get_timestamp_channel(board)
    if arguments.board_file:
        print(BOARD.format(name=BoardShim.get_device_name(board), rate=rate, count=len(rows)), end="")
        return
    parameters = BrainFlowInputParams()
    parameters.serial_port = arguments.port
    shim = BoardShim(board, parameters)
    shim.prepare_session()
    shim.start_stream()
    say(f"{BoardShim.get_device_name(board)}: {len(rows)} channels at {rate} Hz")
    source, number, first = Source(), 0, None
    try:
        while True:
            data = shim.get_board_data()
            for sample in data.T:
                first = sample[clock] if first is None else first
                source.send(sample[rows], sample[clock] - first, number)
                number += 1
            # Twice a frame is soon enough.
            time.sleep(0.5 / rate)
    finally:
        shim.release_session()


if __name__ == "__main__":
    sys.exit(main())
