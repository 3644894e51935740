//! `taxel schema`.

use taxel::acquisition::Stimulus;
use taxel::sensor::Sensor;
use taxel_board::Board;
use taxel_bodies::problem::ProblemFile;
use taxel_study::file::StudyFile;

use crate::arguments::{Schema, SchemaOf};
use crate::{Done, Stop, outputs};

pub(crate) fn run(arguments: &Schema) -> Result<Done, Stop> {
    let text = match arguments.of {
        SchemaOf::Sensor => Sensor::json_schema(),
        SchemaOf::Reference => Sensor::reference(),
        SchemaOf::Stimulus => Stimulus::json_schema(),
        SchemaOf::Study => StudyFile::json_schema(),
        SchemaOf::Board => Board::json_schema(),
        SchemaOf::BoardReference => Board::reference(),
        SchemaOf::Problem => ProblemFile::json_schema(),
        SchemaOf::ProblemReference => ProblemFile::reference(),
    };
    outputs::print(&text)
}
