//! The service `Recomposition`: failure reports and their answers.

use super::Service;
use super::convert::IntoProto;
use super::convert_report::parsed_report;
use super::proto::{self, recomposition_server};
use super::requests::{opened, opened_with_id, told};
use crate::api::problem::document;
use crate::edge::{Refusal, ReportResponse};
use crate::wire::BatchEntry;
use tonic::{Request, Response, Status};

#[tonic::async_trait]
impl recomposition_server::Recomposition for Service {
    async fn report_failure(
        &self,
        request: Request<proto::FailureReport>,
    ) -> Result<Response<proto::RecompositionAnswer>, Status> {
        let (caller, report) = opened(request)?;
        let parsed = parsed_report(report);
        let answered = told(self.edge.report_failure(&caller, parsed).await)?;
        Ok(Response::new(answered.to_wire().into_proto()))
    }

    async fn report_failures(
        &self,
        request: Request<proto::ReportFailuresRequest>,
    ) -> Result<Response<proto::ReportFailuresResponse>, Status> {
        let (caller, request_id, message) = opened_with_id(request)?;
        let parsed = |report| Ok(parsed_report(report));
        let reports = message.failures.into_iter().map(parsed).collect();
        let answers = told(self.edge.report_failures(&caller, reports).await)?;
        let entries = answers
            .iter()
            .map(|answer| batch_entry(answer, &request_id));
        let answers = entries.collect();
        Ok(Response::new(proto::ReportFailuresResponse { answers }))
    }
}

fn batch_entry(answer: &Result<ReportResponse, Refusal>, request_id: &str) -> proto::BatchEntry {
    let entry = match answer {
        Ok(answered) => BatchEntry::Recomposition(Box::new(answered.to_wire())),
        Err(refusal) => BatchEntry::Problem(Box::new(document(refusal, Some(request_id)))),
    };
    entry.into_proto()
}
