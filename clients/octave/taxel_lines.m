% Reads lines of taxel as they come, in MATLAB and in Octave, and draws the pressing force.
%
%   taxel live SENSOR --out csv:tcp:7000        (in a terminal)
%   taxel_lines                                 (here; taxel_lines(7000, 5, "force.png") for a port, seconds and a picture,
%                                               "" for none)
%
% Octave needs its package instrument-control; its tcpclient has no readline, so that lines are cut here.
function taxel_lines(port, seconds, picture)
  if nargin < 1, port = 7000; end
  if nargin < 2, seconds = 10; end
  if exist("OCTAVE_VERSION", "builtin"), pkg("load", "instrument-control"); end
  source = tcpclient("127.0.0.1", port);
  [names, rest] = next_line(source, "");
  names = strsplit(names, ",");
  column = @(name) find(strcmp(names, name));
  time_and_force = [column("time [s]"), column("force_z [N]"), column("force_z_deviation [N]")];
  rows = zeros(0, 3);
  first = NaN;
  while isnan(first) || rows(end, 1) - first < seconds
    [line, rest] = next_line(source, rest);
    numbers = str2double(strsplit(line, ",", "CollapseDelimiters", false));   % NaN where nothing is known
    rows(end + 1, :) = numbers(time_and_force);
    first = rows(1, 1);
  end
  fprintf("%d frames, %.3f s to %.3f s, last force %.4f N\n", size(rows, 1), rows(1, 1), rows(end, 1), rows(end, 2));
  if nargin >= 3 && isempty(picture), return; end
  if nargin < 3, figure; else, figure("visible", "off"); end
  plot(rows(:, 1), rows(:, 2), "b", rows(:, 1), rows(:, 2) + rows(:, 3), "k:", rows(:, 1), rows(:, 2) - rows(:, 3), "k:");
  xlabel("time [s]"); ylabel("pressing force [N]"); legend("force", "one standard deviation");
  if nargin >= 3, print(picture, "-dpng", "-r100"); end
end

% The next line, and what has come behind it.
function [line, rest] = next_line(source, rest)
  while isempty(strfind(rest, sprintf("\n")))
    waiting = max(1, source.NumBytesAvailable);
    rest = [rest, char(read(source, waiting))];
  end
  at = find(rest == sprintf("\n"), 1);
  line = strtrim(rest(1:at - 1));
  rest = rest(at + 1:end);
end
