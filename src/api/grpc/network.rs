//! The service `Network`: nodes, segments, and what is near a place.

use super::Service;
use super::convert::IntoProto;
use super::proto::{self, network_server};
use super::requests::{invalid, opened, told};
use tonic::{Request, Response, Status};

#[tonic::async_trait]
impl network_server::Network for Service {
    async fn get_network(
        &self,
        request: Request<proto::GetNetworkRequest>,
    ) -> Result<Response<proto::GetNetworkResponse>, Status> {
        let (_, message) = opened(request)?;
        use proto::NetworkFormat;
        let (document, etag) = match NetworkFormat::try_from(message.format) {
            Ok(NetworkFormat::Unspecified | NetworkFormat::Geojson) => {
                told(self.edge.network_geojson())?
            }
            Ok(NetworkFormat::Compact) => told(self.edge.network_compact())?,
            Err(_) => {
                let text = format!("there is no format {}", message.format);
                return told(Err(invalid("unknown_value", "/format", text)));
            }
        };
        let is_current = message.etag.as_deref() == Some(&*etag);
        let document = match is_current {
            true => bytes::Bytes::new(),
            false => document,
        };
        let stamp = Some(self.edge.stamp().into_proto());
        Ok(Response::new(proto::GetNetworkResponse {
            document,
            etag,
            stamp,
        }))
    }

    async fn nearest(
        &self,
        request: Request<proto::NearestRequest>,
    ) -> Result<Response<proto::NearestResponse>, Status> {
        let (_, message) = opened(request)?;
        let Some(place) = message.location else {
            let text = "'location' is missing".to_owned();
            return told(Err(invalid("missing_field", "/location", text)));
        };
        let nearest = self
            .edge
            .nearest([place.x, place.y], message.k.unwrap_or(1));
        let nearest = told(nearest)?;
        Ok(Response::new(nearest.into_proto()))
    }
}
